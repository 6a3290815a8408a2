"""Stick and slip over many cycles: each dissipates 4 mu Fn (A - mu Fn / ks), and nothing else is gained or lost."""

import numpy as np
import pytest
from disc_cases import KN, KS, MU, displace, loose_discs

from dem_server.effects.rolling import Rolling
from dem_server.energy import stored

R, OVERLAP, CYCLES, STEPS = 0.03, 1.0e-5, 150, 500


def work(amplitude, spin_of_other, **changes):
    """Work of turning a disc to and fro by +-`amplitude`, the other by `spin_of_other` as much; energy stored at the end."""
    model, state = loose_discs([[0.0, 0.0], [2.0 * R - OVERLAP, 0.0]], [R, R], bond=None, **changes)
    turns = np.diff(amplitude * np.interp(np.arange(STEPS + 1) / STEPS, [0, 0.25, 0.75, 1], [0, 1, -1, 0]))
    done, before, start = 0.0, state.moment.copy(), stored(model, state)
    for _ in range(CYCLES):
        for turn in turns:
            spin = np.array([spin_of_other * turn, turn])
            displace(model, state, np.zeros((2, 2)), spin)
            done -= 0.5 * (before + state.moment) @ spin
            before = state.moment.copy()
    return done, stored(model, state) - start


def test_slip():
    limit, lever = MU * KN * OVERLAP, R - 0.5 * OVERLAP
    slip = 4.0 * limit / KS
    done, kept = work(slip / (2.0 * lever), 1.0)
    assert done - kept == pytest.approx(CYCLES * 4.0 * limit * (slip - limit / KS), rel=1e-2)
    assert done == pytest.approx((4 * CYCLES * (slip - limit / KS) + limit / (2 * KS)) * limit, rel=1e-3)


def test_rolling():
    limit, kr = 0.3 * 0.5 * R * KN * OVERLAP, KS * (0.5 * R) ** 2
    turn = 4.0 * limit / kr
    done, _ = work(0.5 * turn, -1.0, rolling=Rolling(coefficient=0.3))
    assert done == pytest.approx((4 * CYCLES * (turn - limit / kr) + limit / (2 * kr)) * limit, rel=1e-3)
