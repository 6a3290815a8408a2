"""Watch of strongly stretched zones on the rims of windows, whose results are inaccurate.

A side of the rim that has become lambda times as long has gaps of 2 r (lambda - 1) between its control discs (radius r). At
lambda = 2 a gap is two smallest radii, room for a disc (dem_server/coupling/ring_guard.py watches the gaps). Force, moment and
power are still transferred exactly (coupler_protocol/interface/mapping.py), but beyond the stretch FAR one zone of constant
strain replaces several. A stretch across the rim opens no gap. With X, x the diagonals (2,2) of a zone as drawn and now, the mean
deformation gradient and its stretch are

    F = x X^-1,    lambda = largest singular value of F                                   (1)

(exact for uniform strain of the zone; for a triangle two sides replace the diagonals).
"""

from typing import NamedTuple

import numpy as np

from coupler_protocol.files.kept import Kept
from coupler_protocol.geometry import spot
from coupler_protocol.scene.local_origin import in_the_scene

FAR = 3.0


class Stretched(NamedTuple):
    """The zone with the largest stretch: its stretch, number, and centre `place` (2,) [m] in the scene."""

    stretch: float
    zone: int
    place: np.ndarray
    where: str

    def as_text(self):
        """Text with number, place and stretch of the zone."""
        return f"zone {self.zone} at {self.where} is stretched to {self.stretch:.2g} times its size"


class StretchWatch(Kept):
    """Watch of the zones with a corner among the gridpoints `nodes` (K,) of rims, during one stage."""

    KEPT = ("worst", "warned")

    def __init__(self, model, nodes):
        beside = np.isin(model.zones, nodes).any(axis=1)
        self.zones, self.number = model.zones[beside], model.zone[beside]
        self.drawn, self.origin = model.grid.xy, model.grid.origin
        self.worst, self.warned = None, False

    def restore(self, saved):
        """Sets what `saved` gave."""
        super().restore(saved)
        self.worst = None if self.worst is None else Stretched(**self.worst)

    def check(self, displacement):
        """Measures stretches with displacements (N,2) [m] since the grid was drawn; returns a warning the first time, else ""."""
        now = self.drawn + displacement
        stretch = stretches(self.drawn, now, self.zones)
        i = int(stretch.argmax())
        if self.worst is None or stretch[i] > self.worst.stretch:
            centre = now[self.zones[i]].mean(axis=0)
            place = in_the_scene(centre, self.origin)
            self.worst = Stretched(float(stretch[i]), int(self.number[i]), place, spot(centre, self.origin))
        due = stretch[i] >= FAR and not self.warned
        self.warned |= bool(due)
        return f"on the rim of a window {self.worst.as_text()}: use finer zones there" if due else ""

    def report(self):
        """Content of a stage's row in run.json if there was a warning; else {}."""
        if not self.warned:
            return {}
        found = {"zone": self.worst.zone, "stretch": self.worst.stretch, "place": self.worst.place.tolist()}
        return {"rim_stretched": found}


def stretches(drawn, now, zones):
    """Largest stretch (Z,) of zones (Z,4) by Eq (1), from gridpoints (N,2) [m] as drawn and now."""
    before, after = diagonals(drawn, zones), diagonals(now, zones)
    return np.linalg.svd(after @ np.linalg.inv(before), compute_uv=False)[:, 0]


def diagonals(xy, zones):
    """Both diagonals of zones (Z,4) as columns (Z,2,2) [m]; a triangle's fourth corner is its third."""
    a, b, c, d = (xy[zones[:, k]] for k in range(4))
    return np.stack([c - a, d - b], axis=2)
