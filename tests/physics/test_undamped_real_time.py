"""Without damping and friction the default step of real time keeps energy: the full test is 1e6 steps within 1 %."""

import numpy as np
import pytest
from disc_cases import loose_discs

from coupler_protocol.scene import scene_class
from dem_server import energy
from dem_server.cycle import advance, in_real_time
from dem_server.neighbours import rebuild
from dem_server.walls import make_walls

R, SIDE = 0.03, 6
BOX = SIDE * 2.2 * R


def default_fraction():
    discs = scene_class().model_fields["discs"].annotation.__args__[0]
    return discs.model_fields["time_step"].default


def gas(speed, fraction):
    """Discs of three sizes in a box, moving at random."""
    rng = np.random.default_rng(4)
    side = (np.arange(SIDE) + 0.5) * 2.2 * R
    xy = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    model, state = loose_discs(xy, R * rng.choice([0.8, 0.9, 1.0], len(xy)), bond=None, friction=None, damping=None)
    corners = np.array([[0.0, 0.0], [BOX, 0.0], [BOX, BOX], [0.0, BOX]])
    state.walls = make_walls(np.hstack([corners, np.roll(corners, -1, axis=0)]), np.zeros((4, 2)), model)
    rebuild(model, state)
    model = in_real_time(model, state, fraction)
    state.v[:] = rng.normal(0.0, speed, xy.shape)
    return model, state


def mean_energy(model, state, steps=400):
    """Mean over steps of kinetic (of both half steps) and elastic energy."""
    total = 0.0
    for _ in range(steps):
        before, stored = energy.kinetic(model, state), energy.stored(model, state)
        advance(model, state, 0.0, 1)
        total += 0.5 * (before + energy.kinetic(model, state)) + stored
    return total / steps


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
    """100 m/s would be more than a tenth of the radius a step."""
    model, state = loose_discs([[0.0, 0.0], [1.0, 0.0]], [R, R], bond=None, friction=None, damping=None)
    model = in_real_time(model, state, 0.5)
    whole = state.next_dt
    state.v[0, 0] = 100.0
    advance(model, state, 0.0, 1000)
    assert state.next_dt < whole
    assert 100.0 * state.next_dt <= 0.1 * R
    assert state.x[0, 0] < state.x[1, 0]  # it has hit the other, not passed through it
    np.testing.assert_allclose(state.v, [[0.0, 0.0], [100.0, 0.0]], atol=1e-3)
