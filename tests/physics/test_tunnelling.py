"""Real time: nothing passes through a wall, a disc or a clump within a step, not even in the first one."""

from types import SimpleNamespace

import numpy as np
import pytest
from disc_cases import KN, loose_discs

from dem_server.effects.spring import Spring
from dem_server.step.contact_pass import contact_forces
from dem_server.step.cycle import advance, in_real_time, in_static_mode
from dem_server.step.walls import make_walls
from dem_server.stones import bodies

R = 0.03
MASS = 2000.0 * np.pi * R**2
SMOOTH = {"bond": None, "friction": None, "damping": None}
STOPS = R * np.sqrt(KN / MASS)  # speed that a wall's spring can just turn round before the centre is on the wall [m/s]


def test_the_first_step_is_short_enough_for_a_wall():
    """A disc so fast that the step of stability would carry it across the wall comes back with its speed."""
    speed, turned = 0.85 * STOPS, 0.5
    along, across = np.array([np.cos(turned), np.sin(turned)]), np.array([-np.sin(turned), np.cos(turned)])
    model, state = loose_discs([-1.001 * R * along], [R], **SMOOTH)
    state.walls = make_walls([[*(-across), *across]], [[0.0, 0.0]], model)
    model = in_real_time(model, state, 1.0)  # .85 radii in the first step without the guard
    state.v[0] = speed * along
    advance(model, state, 0.0, 200)
    assert state.v[0] @ along == pytest.approx(-speed, rel=1e-3)
    assert state.x[0] @ along < -R


def test_the_first_step_is_short_enough_for_a_disc():
    """Two equal discs exchange their velocities."""
    along = np.array([0.6, 0.8])
    model, state = loose_discs([[0.0, 0.0], 2.001 * R * along], [R, R], **SMOOTH)
    model = in_real_time(model, state, 1.0)
    state.v[0] = 1.3 * STOPS * along
    advance(model, state, 0.0, 200)
    np.testing.assert_allclose(state.v @ along, [0.0, 1.3 * STOPS], atol=2e-3 * STOPS)


def test_a_fast_wall_shortens_the_step():
    """It would jump over the disc in the first step."""
    model, state = loose_discs([[1.001 * R, 0.0]], [R], **SMOOTH)
    state.walls = make_walls([[0.0, -1.0, 0.0, 1.0]], [[0.8 * STOPS, 0.0]], model)
    model = in_real_time(model, state, 1.0)
    advance(model, state, 0.0, 300)
    assert state.v[0, 0] == pytest.approx(1.6 * STOPS, rel=2e-3)
    assert 0.8 * STOPS * state.dt <= 0.1 * R


def test_the_tip_of_a_turning_clump_counts():
    """A stone 40 R long turns: its tip, not its centroid, would jump over the disc beside it."""
    grain = SimpleNamespace(density=2000.0, spring=Spring(normal=5e7, shear=2e7), bond=None)
    bar = [[2.0 * R * k, 0.0] for k in range(-10, 11)]
    model, state = loose_discs([*bar, [20.0 * R, 2.2 * R]], np.full(22, R), stone=grain, **SMOOTH)
    outline = np.array([[-21.0, -1.0], [21.0, -1.0], [21.0, 1.0], [-21.0, 1.0]]) * R
    bodies.assign_discs(model, state, [outline], 2000.0)
    model = bodies.form_stones(model, state, [outline], "clump")
    model = in_real_time(model, state, 1.0)
    spin = 1.0 * STOPS / (20.0 * R)
    state.clumps.motion[0, 4] = spin
    assert state.next_dt * STOPS > 0.5 * R
    before = state.clumps.motion[0, 7] * spin
    advance(model, state, 0.0, 500)
    assert state.v[21, 1] > 0.5 * STOPS  # struck, not passed over
    momentum = state.mass[21] * (state.x[21, 0] * state.v[21, 1] - state.x[21, 1] * state.v[21, 0])
    motion = state.clumps.motion[0]
    own = motion[7] * motion[4] + motion[6] * (motion[0] * motion[3] - motion[1] * motion[2])
    assert own + momentum == pytest.approx(before, rel=1e-10)


def test_a_speed_that_no_spring_can_stop_ends_the_run():
    """The centre gets past the wall however short the step is: the run says so and does not go on."""
    model, state = loose_discs([[0.0, 1.5 * R]], [R], **SMOOTH)
    state.walls = make_walls([[-1.0, 0.0, 1.0, 0.0]], [[0.0, 0.0]], model)
    model = in_real_time(model, state, 0.1)
    state.v[0, 1] = -1.2 * STOPS
    with pytest.raises(ArithmeticError, match=r"disc 0 .* through a wall.* stop 56.8 m/s"):
        advance(model, state, 0.0, 1000)


def test_discs_that_no_spring_can_keep_apart_end_the_run():
    model, state = loose_discs([[0.0, 0.0], [3.0 * R, 0.1 * R]], [R, R], **SMOOTH)
    model = in_real_time(model, state, 0.1)
    state.v[0, 0] = 4.0 * STOPS
    with pytest.raises(ArithmeticError, match=r"disc 0 is going through disc 1.* stop 89.2 m/s"):
        advance(model, state, 0.0, 1000)


def test_static_mode_caps_from_the_first_step():
    """Two discs all but on top of each other, a third far away: pushed apart by a tenth of a radius a step at most."""
    model, state = loose_discs([[0.0, 0.0], [0.01 * R, 0.0], [10.0 * R, 0.0]], [R, R, R], **SMOOTH)
    model = in_static_mode(model, state)
    before = state.x.copy()
    for _ in range(60):
        advance(model, state, 0.0, 1)
        assert np.hypot(*(state.x - before).T).max() <= 0.1 * R * (1.0 + 1e-12)
        before = state.x.copy()
    assert state.capped > 0
    assert np.diff(state.x[:2, 0])[0] >= 2.0 * R


def test_a_wall_that_would_jump_over_discs_is_refused_in_static_mode():
    model, state = loose_discs([[0.0, 0.0]], [R], **SMOOTH)
    state.walls = make_walls([[-1.0, -R, 1.0, -R]], [[0.0, 0.11 * R]], model)
    with pytest.raises(ArithmeticError, match=r"more than 0\.003 m"):
        in_static_mode(model, state)


def test_deep_overlap_at_the_start_is_refused_in_real_time():
    model, state = loose_discs([[0.0, 0.0], [0.5 * R, 0.0]], [R, R], **SMOOTH)
    contact_forces(model, state)
    with pytest.raises(ArithmeticError, match="static stage"):
        in_real_time(model, state, 0.1)
