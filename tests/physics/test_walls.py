"""Walls are flat, carry what presses on them, push what they meet, and keep energy."""

from types import SimpleNamespace

import numpy as np
import pytest
from disc_cases import KN, loose_discs

from dem_server.effects.damping import Damping
from dem_server.effects.dashpot import Dashpot
from dem_server.effects.friction import Friction
from dem_server.effects.rolling import Rolling
from dem_server.effects.spring import Spring
from dem_server.observe import energy
from dem_server.observe.unbalanced_ratio import unbalanced_ratio
from dem_server.step.contact_pass import contact_forces
from dem_server.step.cycle import advance, in_real_time, in_static_mode
from dem_server.step.walls import make_walls
from dem_server.stones import bodies

R, G = 0.03, 9.81


def with_walls(xy, ends, velocity=None, **changes):
    """Model and State of discs of radius R and of walls."""
    model, state = loose_discs(xy, np.full(len(xy), R), bond=None, **changes)
    state.walls = make_walls(ends, np.zeros((len(ends), 2)) if velocity is None else velocity, model)
    contact_forces(model, state)
    return model, state


def test_a_disc_in_a_groove_presses_on_both_sides():
    """Two walls at 45 degrees, no friction: each carries weight / sqrt 2 along its normal."""
    ends = [[0.0, 0.0, 1.0, 1.0], [-1.0, 1.0, 0.0, 0.0]]
    model, state = with_walls([[0.0, np.sqrt(2.0) * R]], ends, friction=None)
    model = in_static_mode(model, state)
    advance(model, state, G, 500)
    assert unbalanced_ratio(model, state, G) < 1e-8
    half = 0.5 * state.weight[0] * G
    np.testing.assert_allclose(state.walls.force, [[half, -half], [-half, -half]], rtol=1e-8)
    assert energy.stored(model, state) == pytest.approx(2.0 * half**2 / KN, rel=1e-8)  # two springs, each of force sqrt 2 half


@pytest.mark.parametrize("rolling", [None, 0.2])
@pytest.mark.parametrize(("friction", "expected"), [(0.9, None), (0.05, "slides")])
def test_disc_on_a_slope(friction, expected, rolling):
    slope = 0.4
    normal, along = np.array([np.sin(slope), np.cos(slope)]), np.array([np.cos(slope), -np.sin(slope)])
    press = 2000.0 * np.pi * R**2 * G * np.cos(slope) / KN
    changes = {"friction": Friction(coefficient=friction), "damping": None}
    changes["rolling"] = None if rolling is None else Rolling(coefficient=rolling)
    model, state = with_walls([(R - press) * normal], [[*(-along), *(9.0 * along)]], **changes)
    model = in_real_time(model, state, 0.2)
    start, way = state.x[0].copy(), []
    for _ in range(2):
        time = advance(model, state, G, 3000)
        way.append((state.x[0] - start) @ along)
    rolls = 2.0 / 3.0 * (np.sin(slope) - (rolling or 0.0) * np.cos(slope))
    slides = np.sin(slope) - friction * np.cos(slope)
    assert (way[1] - 2.0 * way[0]) / time**2 == pytest.approx(G * (slides if expected else rolls), rel=1e-3)


@pytest.mark.parametrize("beta", [0.0, 0.2])
def test_rebound(beta):
    """A wall does not move: m is the disc's mass, e = exp(-pi beta / sqrt(1 - beta^2))."""
    dashpot = Dashpot(normal=beta, tension=True)
    model, state = with_walls([[0.0, R]], [[-1.0, 0.0, 1.0, 0.0]], friction=None, damping=None, dashpot=dashpot)
    model = in_real_time(model, state, 1e-4)
    state.v[0, 1] = -1.0
    advance(model, state, 0.0, round(4.0 * np.sqrt(state.mass[0] / KN) / state.next_dt))
    assert state.v[0, 1] == pytest.approx(np.exp(-np.pi * beta / np.sqrt(1.0 - beta**2)), abs=1e-4)


def test_a_moving_wall_pushes():
    """Elastic push by a wall at speed V: the disc leaves at 2 V; and the wall is where it should be."""
    model, state = with_walls([[0.0, 0.0]], [[-R, -1.0, -R, 1.0]], [[0.5, 0.0]], friction=None, damping=None)
    model = in_real_time(model, state, 1e-3)
    time = advance(model, state, 0.0, 5000)
    np.testing.assert_allclose(state.v[0], [1.0, 0.0], atol=1e-5)
    assert state.walls.ends[0, 0] == pytest.approx(-R + 0.5 * time, rel=1e-12)


def test_friction_of_a_moving_wall_drags():
    """Belt under a resting disc: mu g until it rolls, in the static mode held by nothing."""
    press = 2000.0 * np.pi * R**2 * G / KN
    belt = [[-9.0, 0.0, 9.0, 0.0]]
    model, state = with_walls([[0.0, R - press]], belt, [[1.0, 0.0]], friction=Friction(coefficient=0.1), damping=None)
    model = in_real_time(model, state, 0.1)
    time = advance(model, state, G, 2000)
    assert state.v[0, 0] == pytest.approx(0.1 * G * time, rel=2e-3)


def test_a_box_of_walls_keeps_its_discs_in_static_mode():
    side = np.arange(5) * 2.0 * R
    xy = np.stack(np.meshgrid(R + side + 0.001, R + side), axis=-1).reshape(-1, 2)
    box = 10.0 * R + 0.002
    ends = [[0.0, 0.0, box, 0.0], [box, 0.0, box, 1.0], [0.0, 0.0, 0.0, 1.0]]
    model, state = with_walls(xy, ends, damping=Damping(local=0.7))
    model = in_static_mode(model, state)
    for _ in range(60):
        advance(model, state, G, 500)
        if unbalanced_ratio(model, state, G) < 1e-6:
            break
    weight = state.weight.sum() * G
    np.testing.assert_allclose(state.walls.force.sum(axis=0), [0.0, -weight], atol=1e-4 * weight)


@pytest.mark.parametrize("real", [None, 0.1])
def test_a_rigid_stone_on_a_wall(real):
    """Four discs as one clump come to rest on the ground with their whole weight, without any disc turning by itself."""
    xy = np.array([[0.0, R], [2.0 * R, R], [0.0, 3.0 * R], [2.0 * R, 3.0 * R]])
    grain = SimpleNamespace(density=2000.0, spring=Spring(normal=5e8, shear=5e8), friction=Friction(coefficient=0.5), bond=None)
    changes = {"stone": grain, "friction": Friction(coefficient=0.5), "dashpot": Dashpot(normal=0.3, shear=0.3)}
    grain.dashpot = changes["dashpot"]
    model, state = loose_discs(xy, np.full(4, R), bond=None, **changes)
    square = np.array([[-R, 0.0], [3.0 * R, 0.0], [3.0 * R, 4.0 * R], [-R, 4.0 * R]])
    bodies.assign_discs(model, state, [square], 2000.0)
    model = bodies.form_stones(model, state, [square], "clump")
    state.walls = make_walls([[-1.0, 0.0, 1.0, 0.0]], np.zeros((1, 2)), model)
    contact_forces(model, state)
    model = in_static_mode(model, state) if real is None else in_real_time(model, state, real)
    for _ in range(40):
        advance(model, state, G, 1000)
        if unbalanced_ratio(model, state, G) < 1e-6:
            break
    weight = 2000.0 * (4.0 * R) ** 2 * G
    np.testing.assert_allclose(state.walls.force[0], [0.0, -weight], rtol=1e-5, atol=1e-5 * weight)
    np.testing.assert_allclose(state.angle, state.clumps.motion[0, 5], atol=1e-12)
    assert state.capped == 0
