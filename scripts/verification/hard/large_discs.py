"""Discs larger than the zones they push against.

A quarter of a ring with fine zones (0.19 to 0.44 m along the rim) and a window with oblique and curved sides, full of bonded
discs up to 0.6 m wide, three times the shortest zones: one touches control discs of several segments at once. Free, shaken, in
real time without damping. `colluvium check` must say that discs are larger than zones."""

import numpy as np

from coupler_protocol.scene.rules.between_tables import doubts
from verification.coupling.energy import followed
from verification.hard.coupled_system import scene
from verification.hard.free_body import Carried, body, sector
from verification.verdict_rows import row

NAME = "large discs"
R = 0.25
FINE = {
    "grid": {"kind": "ring", "part": "quarter", "inner": 1.0, "outer": 12.0, "around": 32},
    "window": [{"name": "hole", "polygon": sector(4.0, 9.0, 0.25, 1.3)}],
}


def rows(fast):
    """10,000 steps (fast: 1,000)."""
    said = [what for _, what, _ in doubts(scene(1.0, R, 0.0, oblique=True, **FINE)) if "larger than zones" in what]
    yield row("warnings of `check` about it", len(said), 1.0, 0.0, "as asked for")
    joined, carried = body(size=R, **FINE), Carried()
    steps = 1000 if fast else 10_000
    energy, lost = followed(joined, steps, 1e-6 * R, every=10, look=lambda j: carried.look(j.rim, j.discs))
    yield from carried.rows()
    yield row("momentum lost, over its parts", lost, 0.0, 1e-13, "conservation")
    yield row("energy, band over it", np.ptp(energy) / energy.mean(), 0.0, 1e-6, "conservation (leap-frog)")
