"""Watch of strongly stretched zones on the rims of windows, whose results are inaccurate.

A side of the rim that has become lambda times as long has gaps of 2 r (lambda - 1) between its control discs (radius r). At
lambda = 2 a gap is two smallest radii, room for a disc (dem_server/coupling/ring_guard.py watches the gaps). Force, moment and
power are still transferred exactly (coupler_protocol/interface/mapping.py), but beyond the stretch FAR one zone of constant
strain replaces several. A stretch across the rim opens no gap. With X, x the diagonals (2,2) of a zone as drawn and now, the mean
deformation gradient and its stretch are

    F = x X^-1,    lambda = largest singular value of F                                   (1)

(exact for uniform strain of the zone; for a triangle two sides replace the diagonals).
"""

from math import hypot
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coupler_protocol.compiled.jit import jit
from coupler_protocol.files.kept import like, value_of
from coupler_protocol.geometry import spot
from coupler_protocol.scene.local_origin import in_the_scene

FAR = 3.0
WORST, ROW, PLACE_X, PLACE_Y, NOW, WARNED = range(6)  # of Stretch.found


class Stretched(NamedTuple):
    """The zone with the largest stretch: its stretch, number, and centre `place` (2,) [m] in the scene."""

    stretch: float
    zone: int
    place: np.ndarray
    where: str

    def as_text(self):
        """Text with number, place and stretch of the zone."""
        return f"zone {self.zone} at {self.where} is stretched to {self.stretch:.2g} times its size"


class Stretch(NamedTuple):
    """Z zones on rims: drawn (N,2) [m] of all gridpoints, zones (Z,4), inverse (Z,2,2): X^-1 of Eq (1).

    found (6,): largest stretch so far, row of its zone, centre of that zone then [m], largest stretch now, whether was warned.
    """

    drawn: NDArray[np.float64]
    zones: NDArray[np.int64]
    inverse: NDArray[np.float64]
    found: NDArray[np.float64]


@jit
def largest_stretch(a, b, c, d):
    """The larger singular value of the matrix [[a, b], [c, d]]."""
    return 0.5 * (hypot(a + d, c - b) + hypot(a - d, b + c))


@jit
def watch_stretch(displacement, stretch):
    """Measures stretches with displacements (N,2) [m]; returns whether a warning is due."""
    drawn, zones, inverse, found = stretch
    found[NOW] = 0.0
    for z in range(len(zones)):
        i, j, k, m = zones[z, 0], zones[z, 1], zones[z, 2], zones[z, 3]
        ix, iy = drawn[i, 0] + displacement[i, 0], drawn[i, 1] + displacement[i, 1]
        jx, jy = drawn[j, 0] + displacement[j, 0], drawn[j, 1] + displacement[j, 1]
        kx, ky = drawn[k, 0] + displacement[k, 0], drawn[k, 1] + displacement[k, 1]
        mx, my = drawn[m, 0] + displacement[m, 0], drawn[m, 1] + displacement[m, 1]
        ax, ay, bx, by = kx - ix, ky - iy, mx - jx, my - jy  # the diagonals
        now = largest_stretch(
            ax * inverse[z, 0, 0] + bx * inverse[z, 1, 0], ax * inverse[z, 0, 1] + bx * inverse[z, 1, 1],
            ay * inverse[z, 0, 0] + by * inverse[z, 1, 0], ay * inverse[z, 0, 1] + by * inverse[z, 1, 1],
        )  # fmt: skip
        found[NOW] = max(found[NOW], now)
        if now > found[WORST]:
            found[WORST], found[ROW] = now, z
            found[PLACE_X], found[PLACE_Y] = 0.25 * (ix + jx + kx + mx), 0.25 * (iy + jy + ky + my)
    return found[NOW] >= FAR and found[WARNED] == 0.0


class StretchWatch:
    """Watch of the zones with a corner among the gridpoints `nodes` (K,) of rims, during one stage."""

    def __init__(self, model, nodes):
        beside = np.isin(model.zones, nodes).any(axis=1)
        self.number, self.origin = model.zone[beside], model.grid.origin
        zones = model.zones[beside]
        self.stretch = Stretch(model.grid.xy, zones, np.linalg.inv(diagonals(model.grid.xy, zones)), np.zeros(6))

    @property
    def warned(self):
        """Whether a stretch has caused a warning."""
        return bool(self.stretch.found[WARNED])

    @property
    def worst(self):
        """The Stretched zone with the largest stretch so far."""
        stretch, row, x, y = self.stretch.found[: PLACE_Y + 1].tolist()
        centre = np.array([x, y])
        return Stretched(stretch, int(self.number[int(row)]), in_the_scene(centre, self.origin), spot(centre, self.origin))

    def saved(self):
        """What changes, for a checkpoint inside of the stage."""
        return {"found": self.stretch.found}

    def restore(self, saved):
        """Sets what `saved` gave."""
        self.stretch.found[:] = like("StretchWatch.found", self.stretch.found, value_of(saved, "found"))

    def check(self, displacement):
        """Measures stretches with displacements (N,2) [m] since the grid was drawn; returns a warning the first time, else ""."""
        watch_stretch(displacement, self.stretch)
        return self.judge()

    def judge(self):
        """Returns a warning of the last measurement the first time, else ""."""
        due = self.stretch.found[NOW] >= FAR and not self.warned
        self.stretch.found[WARNED] = self.warned or due
        return f"on the rim of a window {self.worst.as_text()}: use finer zones there" if due else ""

    def report(self):
        """Content of a stage's row in run.json if there was a warning; else {}."""
        if not self.warned:
            return {}
        worst = self.worst
        return {"rim_stretched": {"zone": worst.zone, "stretch": worst.stretch, "place": worst.place.tolist()}}


def diagonals(xy, zones):
    """Both diagonals of zones (Z,4) as columns (Z,2,2) [m]; a triangle's fourth corner is its third."""
    a, b, c, d = (xy[zones[:, k]] for k in range(4))
    return np.stack([c - a, d - b], axis=2)
