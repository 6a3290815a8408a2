"""A coupled body falls freely: zones, discs and the rim between them together.

From rest in real time, undamped, under gravity:  v(n - 1/2) = -g (n - 1/2) dt,  and no force on the rim. Gridpoints carry the
mass and the weight of the control discs' inner shares, and both sides take half a step first. Forces are compared with the
body's weight; kn = 1e6 N/m is low because round-off of positions times stiffness is a force.
"""

import numpy as np

from verification.coupling.block import block
from verification.verdict_rows import row

NAME = "free fall"
SOURCE = "closed form (leap-frog from rest)"
GRAVITY = 9.81


def rows(fast):
    """A block of 7 x 7 zones with a window of 3 x 3, at 29 degrees, 200 steps."""
    joined, steps = block(kn=1e6), 200
    joined.begin(0.5)
    for _ in range(steps):
        joined.step(GRAVITY)
    expected = GRAVITY * (steps - 0.5) * joined.grid.dt
    weight = GRAVITY * (joined.grid_model.weight_mass.sum() + joined.discs.weight.sum())
    moving = np.diff(joined.grid_model.start) > 0
    for side, v in (("gridpoints", joined.grid.velocity[moving]), ("discs", joined.discs.v[joined.disc_model.ring :])):
        error = np.hypot(v[:, 0], v[:, 1] + expected).max() / expected
        yield row(f"velocities of {side}, largest error over g t", error, 0.0, 1e-12, SOURCE)
    yield row("largest force on the rim, over the weight", np.abs(joined.hang()).max() / weight, 0.0, 1e-12, SOURCE)
