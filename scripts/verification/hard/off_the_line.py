"""Control discs a whole radius outside their segments, undamped for a hundred thousand steps.

The body of `free_body.py`, its control discs between nodes moved outwards by R (a tenth to a fifth of a segment), bonds
without force there. The work-consistent mapping conserves the energy of the motion. The paper's mapping loses power off the
segments, and the motion flutters: growth a step is the slope of log(energy)/2, as in the case flutter of the coupling."""

import numpy as np

from verification.coupling.energy import followed
from verification.coupling.flutter import growth_of
from verification.hard.free_body import SIZE, Carried, body
from verification.verdict_rows import row

NAME = "off the line"
EVERY = 10


def rows(fast):
    """100,000 steps (fast: 10,000)."""
    steps, carried = 10_000 if fast else 100_000, Carried()
    energy, lost = followed(body(shift=SIZE), steps, 1e-6 * SIZE, every=EVERY, look=lambda j: carried.look(j.rim, j.discs))
    yield row(f"growth a step in {steps:,} steps", growth_of(energy) / EVERY, 0.0, 1e-9, "power is kept")
    yield row("energy, band over it", np.ptp(energy) / energy.mean(), 0.0, 1e-6, "conservation (leap-frog)")
    yield row("momentum lost, over its parts", lost, 0.0, 1e-12, "conservation")
    yield from carried.rows()
    energy, _ = followed(body(shift=SIZE, mapping="paper"), steps, 1e-6 * SIZE, every=EVERY)
    yield row("with the paper's mapping: growth a step", growth_of(energy) / EVERY, 0.0, [1e-7, 1e-2], "power is lost")
