"""Motion: weight, damping, speed cap, and static masses that keep every step stable."""

from dataclasses import replace

import numpy as np
import pytest
from copied_state import gone_on_twice
from window_case import SQUARE, packed, soil_discs, two_discs

from dem_server.effects.damping import Damping, damped
from dem_server.pairs import contacts
from dem_server.step.bonds_made import add_bonds
from dem_server.step.contact_pass import contact_forces
from dem_server.step.masses import safety
from dem_server.step.motion import SPEED_CAP, move_free


def test_fall_follows_weight_over_mass():
    model, state = two_discs(damping=None)
    for _ in range(5):
        move_free(model, state, 2.0)
    step = 2.0 * 2000.0 * np.pi * 0.03**2 / state.mass[0]
    np.testing.assert_allclose(state.v[:, 1], -5.0 * step, rtol=1e-12)
    np.testing.assert_allclose(state.displacement[:, 1], -15.0 * step, rtol=1e-9)
    assert not state.v[:, 0].any()


@pytest.mark.parametrize(("force", "velocity", "expected"), [(2, 1, 1), (2, -1, 3), (-2, 1, -3), (-2, -1, -1), (2, 0, 2)])
def test_damping_acts_against_the_motion(force, velocity, expected):
    assert damped(float(force), float(velocity), 0.5) == expected


def test_ring_does_not_move_by_itself():
    model, state = packed(SQUARE, soil_discs(radius=0.08))
    before = state.x[: model.ring].copy()
    state.load[:] = 1e6
    move_free(model, state, 9.81)
    assert (state.x[: model.ring] == before).all()
    assert (state.x[model.ring :] != state.origin[model.ring :]).any()


def test_speed_is_capped_and_counted():
    model, state = two_discs()
    state.load[1, :2] = [3e9, 4e9]
    move_free(model, state, 0.0)
    cap = SPEED_CAP * model.smallest_radius
    np.testing.assert_allclose(state.v[1], [0.6 * cap, 0.8 * cap], rtol=1e-12)
    assert state.capped == 1


@pytest.mark.parametrize(("alpha", "sf"), [(0.0, 0.75), (0.7, 0.75), (0.9, 0.98 / np.sqrt(1.9))])
def test_static_masses_of_a_touching_pair(alpha, sf):
    model, state = two_discs(damping=Damping(local=alpha))
    assert safety(model.law.damping) == sf
    np.testing.assert_allclose(state.mass, 2.5e7 / sf**2, rtol=1e-12)
    np.testing.assert_allclose(state.inertia, 0.5 * state.mass * 0.03**2, rtol=1e-12)


def test_a_copied_state_goes_on_with_the_same_bits():
    """State is all there is: nothing is hidden in the model or in a neighbour list outside of it."""
    model, state = packed(SQUARE, soil_discs())
    add_bonds(model, state)
    state, copy = gone_on_twice(model, state)
    for name, value in vars(state).items():
        assert value is None or np.asarray(value).tobytes() == np.asarray(getattr(copy, name)).tobytes(), name


@pytest.mark.parametrize("damped_motion", [False, True])
def test_bonded_window_is_stable(damped_motion):
    """Undamped, a kick of the bonded discs neither grows nor dies out; damped, it is gone soon."""
    model, state = packed(SQUARE, soil_discs())
    for _ in range(2000):
        move_free(model, state, 0.0)
        contact_forces(model, state)
    add_bonds(model, state)
    if not damped_motion:
        model = replace(model, law=model.law._replace(damping=None))
    pairs = contacts(state)
    number = np.bincount(np.concatenate([pairs.disc_a, pairs.disc_b]), minlength=model.count)
    held = (np.arange(model.count) >= model.ring) & (number >= 3)  # others rightly fly on for ever
    state.disc[:, 2:5] = 0.0
    state.v[held] = np.random.default_rng(0).normal(0.0, 1e-9, (held.sum(), 2))

    def kinetic():
        return float(state.mass @ (state.v**2).sum(axis=1) + state.inertia @ state.spin**2)

    start = kinetic()
    energies = []
    for _ in range(3000):
        move_free(model, state, 0.0)
        contact_forces(model, state)
        energies.append(kinetic())
    if damped_motion:
        assert energies[-1] < 1e-6 * start
    else:
        assert 0.2 * start < min(energies[1000:]) <= max(energies) < 1.5 * start
