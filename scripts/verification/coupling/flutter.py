"""The paper's mapping flutters where control discs are off their segments; the work-consistent one does not.

The body of the case energy, control discs 3 R outside (3/8 of a segment). Equations (11) and (12) move a disc without spin by
the rotation of its segment, but (1) to (10) do not return its force by the transpose: power is lost or gained at the
interface, and an undamped motion grows at any step; the smaller the step, the smaller the growth a step. Growth is the slope
of log(energy)/2 from 10 to 1e5 times the first energy, of the work-consistent mapping over the second half of as many steps."""

import numpy as np

from verification.coupling.block import R
from verification.coupling.energy import shaken
from verification.verdict_rows import row

NAME = "flutter"
SOURCE = "theory: none for a mapping that keeps power"


def growth(mapping, share, steps):
    """Growth of the amplitude a step."""
    return growth_of(shaken(steps, share, mapping=mapping, shift=3.0 * R)[0])


def growth_of(energy):
    """Growth of the amplitude from one of the energies to the next."""
    begin, end = len(energy) // 2, len(energy)
    if energy.max() > 1e5 * energy[0]:
        begin, end = np.argmax(energy > 10.0 * energy[0]), np.argmax(energy > 1e5 * energy[0])
    return 0.5 * np.polyfit(np.arange(begin, end), np.log(energy[begin:end]), 1)[0]


def rows(fast):
    """Both mappings; the paper's at half the step as well (not in the fast form)."""
    for share, steps in ((0.5, 9000),) if fast else ((0.5, 9000), (0.25, 20_000)):
        found = growth("paper", share, steps)
        yield row(f"paper's mapping, step {share:g} of the stable one: growth a step", found, 0.0, [1e-5, 1e-2], SOURCE)
    found = growth("work-consistent", 0.5, 9000)
    yield row("work-consistent mapping, step 0.5: growth a step", found, 0.0, 1e-9, SOURCE)
