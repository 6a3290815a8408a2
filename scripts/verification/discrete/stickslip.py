"""Dissipation of a contact that sticks and slips cyclically.

Two discs pressed together by 1e-5 m, mu = 0.55, rotated cyclically so that their surfaces move by ±A, A = 4 mu Fn / ks; 500
steps a cycle. With l = mu Fn, N cycles that start and end in the middle dissipate (rolling springs likewise, with moments for
forces)

    4 N l (A - l / ks) - l^2 / ks  as heat,     l^2 / 2 ks  as energy of the spring
"""

import numpy as np

from dem_server.effects.rolling import Rolling
from dem_server.observe.energy import stored
from verification.discrete.discs import KN, KS, MU, displace, loose_discs
from verification.verdict_rows import row

NAME = "stick-slip"
R, OVERLAP, CYCLES, STEPS = 0.03, 1.0e-5, 150, 500


def work(amplitude, spin_of_other, cycles=CYCLES, steps=STEPS, **changes):
    """Work of turning a disc to and fro by +-`amplitude`, the other by `spin_of_other` as much; energy stored at the end."""
    model, state = loose_discs([[0.0, 0.0], [2.0 * R - OVERLAP, 0.0]], [R, R], bond=None, **changes)
    turns = np.diff(amplitude * np.interp(np.arange(steps + 1) / steps, [0, 0.25, 0.75, 1], [0, 1, -1, 0]))
    done, before, start = 0.0, state.moment.copy(), stored(model, state)
    for _ in range(cycles):
        for turn in turns:
            spin = np.array([spin_of_other * turn, turn])
            displace(model, state, np.zeros((2, 2)), spin)
            done -= 0.5 * (before + state.moment) @ spin
            before = state.moment.copy()
    return done, stored(model, state) - start


def _closed(cycles, limit, way, stiffness):
    """Work of `cycles` between +-`way`: heat and stored energy [J]."""
    return (4 * cycles * (way - limit / stiffness) - 0.5 * limit / stiffness) * limit


def slipping(cycles=CYCLES, steps=STEPS):
    """Work and stored energy, and the work of the closed form [J]."""
    limit, lever = MU * KN * OVERLAP, R - 0.5 * OVERLAP
    slip = 4.0 * limit / KS
    found = work(slip / (2.0 * lever), 1.0, cycles, steps)
    return *found, _closed(cycles, limit, slip, KS)


def rolling(cycles=CYCLES):
    """Work of a contact that rolls to and fro against its resistance, and the closed form's [J]."""
    limit, kr = 0.3 * 0.5 * R * KN * OVERLAP, KS * (0.5 * R) ** 2
    turn = 4.0 * limit / kr
    done, _ = work(0.5 * turn, -1.0, cycles, rolling=Rolling(coefficient=0.3))
    return done, _closed(cycles, limit, turn, kr)


def rows(fast):
    """150 cycles (fast: 20)."""
    cycles = 20 if fast else CYCLES
    done, _, expected = slipping(cycles)
    yield row(f"work of {cycles} cycles of slip [J]", done, expected, 1e-3, "closed form")
    yield row(f"work of {cycles} cycles of rolling resistance [J]", *rolling(cycles), 1e-3, "closed form")
