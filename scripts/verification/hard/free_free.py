"""An unsupported body of zones and bonded discs, shaken for a million steps without damping.

The body of `free_body.py`: a quarter of a ring of 32 zones around a window with oblique and curved sides, all discs bonded,
displacements of 1e-6 R, in real time at half the stable step. Momentum is that of all gridpoints and discs, over the sum of
the magnitudes of its parts. Trend: mean energy of the last tenth of the steps over that of the first tenth. It is not exactly
1: shear forces accumulate along directions that turn with the motion, which gives an energy proportional to the amplitude
(1e-7 in 20,000 steps at 1e-5 R, 1e-6 at 1e-4 R), and rounded positions make it a random walk."""

import numpy as np

from verification.coupling.energy import followed
from verification.hard.free_body import SIZE, body
from verification.verdict_rows import row

NAME = "free body"
SOURCE = "conservation (leap-frog)"


def rows(fast):
    """A million steps, the energy of every 20th (fast: 20,000)."""
    steps = 20_000 if fast else 1_000_000
    joined = body()
    energy, lost = followed(joined, steps, 1e-6 * SIZE, every=20)
    tenth = len(energy) // 10
    yield row(f"momentum lost in {steps:,} steps, over its parts", lost, 0.0, 1e-12, SOURCE)
    yield row("energy, band over it", np.ptp(energy) / energy.mean(), 0.0, 1e-6, SOURCE)
    trend = energy[-tenth:].mean() / energy[:tenth].mean()
    yield row("energy, last tenth over the first", trend, 1.0, 1e-6, SOURCE)
    speed = max(np.abs(joined.grid.velocity).max(), np.abs(joined.discs.v).max()) * joined.grid.dt / (1e-7 * SIZE)
    yield row("largest speed at the end over that at first", speed, 1.0, [-1.0, 4.0], "bounded")
