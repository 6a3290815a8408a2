"""Kinetic damping: velocities begin again from zero at peaks, rest comes sooner, and nothing that counts changes."""

from types import SimpleNamespace

import numpy as np
import pytest
from zone_cases import GRAVITY, slope, soil

from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import read_scene
from fdm_server.effects.damping import Damping
from fdm_server.mesh.grid import build_grid
from fdm_server.model import build_model, new_state
from fdm_server.step import clock
from fdm_server.step.gridpoint_pass import unbalanced_ratio, update_velocities
from fdm_server.step.momentum import Momentum
from fdm_server.step.zone_pass import advance


def test_momentum_is_taken_at_peaks():
    model = SimpleNamespace(mass=np.ones(1))
    state = SimpleNamespace(added_mass=np.zeros(1), velocity=np.zeros((1, 2)), mass=None, dt=None, in_real_time=False)
    momentum, seen = Momentum(), []
    for speed in (1.0, 2.0, 1.5, 1.0, 0.5):
        state.velocity[:] = speed
        momentum.take(model, state)
        seen.append(float(state.velocity[0, 0]))
    assert seen == [1.0, 2.0, 0.0, 1.0, 0.0]


def rest(damping, ratio=1e-5):
    """Displacements of an elastic slope at rest, and the steps that took."""
    scene = slope(0.5, soil())
    model = build_model(scene, build_grid(scene))
    state = new_state(model)
    model = clock.begin(model, state, damping)
    momentum = Momentum() if damping.kind else None
    for step in range(1, 40000):
        update_velocities(model, state, GRAVITY)
        if momentum:
            momentum.take(model, state)
        advance(model, state)
        if step % 10 == 0 and unbalanced_ratio(model, state, GRAVITY) <= ratio:
            return state.displacement, step
    raise AssertionError("no rest")


def test_rest_is_the_same_in_less_than_half_of_the_steps():
    local, steps = rest(Damping(local=0.8), 1e-7)
    kinetic, fewer = rest(Damping(kind="kinetic"), 1e-7)
    assert fewer < 0.5 * steps
    np.testing.assert_allclose(kinetic, local, atol=1e-5 * np.abs(local).max())


def test_real_time_refuses_it(configs):
    words = ["damping={kind='kinetic'}", "stage.0.time='real'"]
    with pytest.raises(SceneError, match="kinetic damping stops all motion at its peaks"):
        read_scene(configs / "quick_slope.toml", words)


def test_a_driven_side_refuses_it(configs):
    """The reaction of a footing scatters by 8 % with it: driven ground passes no equilibrium."""
    with pytest.raises(SceneError, match="a side is driven"):
        read_scene(configs / "footing.toml", ["damping={kind='kinetic'}"])
