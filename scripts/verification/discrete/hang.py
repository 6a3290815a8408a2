"""A chain of contact bonds hangs from a held disc and carries its own weight.

N = 8 discs of R = 0.03 m in touch one below the other. With w the weight of a disc the bond above disc i, i from 0, carries (N
- i) w:

    path of the lowest disc w N (N + 1) / 2 kn,     breaks at the top bond when N w = its tensile strength

Gravity grows in a thousand stages of 400 static steps with local damping; the tolerance is one of these stages.
"""

import numpy as np

from dem_server.effects.bond import BONDED, Bond
from dem_server.step.cycle import advance
from verification.discrete.discs import KN, with_held
from verification.verdict_rows import row

NAME = "hang"
R, FREE, STRENGTH = 0.03, 8, 1500.0


def chain():
    """Model and State of the bonded chain; the held disc is number 0, at the top."""
    xy = np.column_stack([np.zeros(FREE + 1), -2.0 * R * np.arange(FREE + 1)])
    model, state = with_held(xy[:1], [R], xy[1:], np.full(FREE, R), bond=Bond(tension=STRENGTH, shear=3500.0))
    state.bond_state[:] = BONDED
    return model, state


def rows(fast):
    """Way at half the strength, then the gravity at which it breaks, and where."""
    model, state = chain()
    weight = state.weight[-1]
    breaks = STRENGTH / (FREE * weight)
    stages = 1000
    for stage in range(1, 2 * stages):
        advance(model, state, breaks * stage / stages, 400)
        if stage == stages // 2:
            expected = 0.5 * breaks * weight * FREE * (FREE + 1) / (2.0 * KN)
            yield row("way of the lowest disc at half strength [m]", -state.displacement[-1, 1], expected, 1e-3, "closed form")
        if state.broken_tension:
            break
    yield row("gravity at which it breaks [m/s2]", breaks * stage / stages, breaks, [-1e-9, 1.01 / stages], "closed form")
    advance(model, state, breaks, 400)
    yield row("discs that fall", np.count_nonzero(state.displacement[:, 1] < -R), FREE, 0.0, "closed form")
