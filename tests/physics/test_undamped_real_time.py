"""Without damping and friction the default step of real time keeps energy: the full test is 1e6 steps within 1 %."""

import numpy as np
import pytest
from disc_cases import loose_discs
from verification.discrete.gas import BOX, R, default_fraction, gas, mean_energy

from dem_server.step.cycle import advance, in_real_time


@pytest.mark.parametrize("speed", [0.3, 3.0])
def test_energy_stays(speed):
    model, state = gas(speed, default_fraction())
    start = mean_energy(model, state)
    for _ in range(5):
        advance(model, state, 0.0, 20000)
        assert mean_energy(model, state) == pytest.approx(start, rel=1e-2)
    assert state.x.min() > 0.0
    assert state.x.max() < BOX


def test_large_steps_do_not_keep_it():
    """What the test above would see."""
    model, state = gas(3.0, 0.8)
    start = mean_energy(model, state)
    advance(model, state, 0.0, 100000)
    assert mean_energy(model, state) > 1.05 * start


def test_momentum_of_free_discs_is_kept_and_nothing_is_capped():
    model, state = gas(3.0, 0.1)
    state.walls = None
    before = state.mass @ state.v
    advance(model, state, 0.0, 5000)
    np.testing.assert_allclose(state.mass @ state.v, before, rtol=1e-11)
    assert state.capped == 0


def test_a_disc_too_fast_for_its_step_shortens_it():
    """80 m/s would be more than a tenth of the radius a step."""
    model, state = loose_discs([[0.0, 0.0], [1.0, 0.0]], [R, R], bond=None, friction=None, damping=None)
    model = in_real_time(model, state, 0.5)
    whole = state.next_dt
    state.v[0, 0] = 80.0
    advance(model, state, 0.0, 1000)
    assert state.next_dt < whole
    assert 80.0 * state.next_dt <= 0.1 * R
    assert state.x[0, 0] < state.x[1, 0]  # it has hit the other, not passed through it
    np.testing.assert_allclose(state.v, [[0.0, 0.0], [80.0, 0.0]], atol=0.02)
