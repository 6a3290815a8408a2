"""Waves along a chain of bonded discs: omega = 2 sqrt(k/m) sin(q l / 2), leap-frog sin(omega' dt / 2) = omega dt / 2."""

import numpy as np
import pytest
from disc_cases import KN, with_held

from dem_server.cycle import advance, in_real_time
from dem_server.effects.bond import BONDED, Bond

R, FREE = 0.03, 16


@pytest.mark.parametrize("turned", [0.0, 0.8])
@pytest.mark.parametrize("wave", [1, 5, 16])
def test_standing_wave(wave, turned):
    along = np.array([np.cos(turned), np.sin(turned)])
    at = np.arange(FREE + 2) * 2.0 * R
    held, free = np.outer(at[[0, -1]], along), np.outer(at[1:-1], along)
    glue = Bond(tension=1e9, shear=1e9)
    model, state = with_held(held, [R, R], free, np.full(FREE, R), bond=glue, damping=None)
    state.bond_state[np.arange(state.partner.shape[1]) < state.used[:, None]] = BONDED
    model = in_real_time(model, state, 0.2)
    q = np.pi * wave / (FREE + 1) / (2.0 * R)
    shape = np.sin(q * at[1:-1])
    state.v[2:] = np.outer(1e-3 * shape, along)
    amplitude = []
    for _ in range(2000):
        advance(model, state, 0.0, 1)
        amplitude.append(shape @ (state.displacement[2:] @ along))
    a = np.array(amplitude)
    cosine = (a[2:] + a[:-2]) @ a[1:-1] / (2.0 * a[1:-1] @ a[1:-1])
    expected = 2.0 * np.sqrt(KN / state.mass[2]) * np.sin(q * R)
    assert np.sqrt(2.0 * (1.0 - cosine)) / state.dt == pytest.approx(expected, rel=1e-6)
