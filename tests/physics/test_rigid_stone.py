"""Rigid stones: collisions conserve momentum and moment of momentum, and a rigid motion of all changes no force."""

import numpy as np
import pytest
from verification.discrete.stone import R, angles, quarter_turn

from dem_server.pairs import contacts
from dem_server.step.contact_pass import contact_forces
from dem_server.step.motion import move_free


def momentum(state):
    """Momentum and moment of momentum about the origin of clumps and loose discs (3,), and their scale."""
    x, y, u, v, spin, _, mass, inertia = state.clumps.motion.T
    own = state.clumps.body < 0
    p = np.concatenate([mass * u, state.mass[own] * state.v[own, 0]])
    q = np.concatenate([mass * v, state.mass[own] * state.v[own, 1]])
    X, Y = (np.concatenate([a, b]) for a, b in ((x, state.x[own, 0]), (y, state.x[own, 1])))
    turning = np.concatenate([inertia * spin, state.inertia[own] * state.spin[own]])
    return np.array([p.sum(), q.sum(), (turning + X * q - Y * p).sum()]), np.abs([p, q, X * q]).sum()


def test_collisions_conserve_momentum_and_its_moment():
    """Two stones and a disc, a hair apart, oblique, moving and turning, collide without damping, with friction."""
    c, s = np.cos(0.3), np.sin(0.3)
    height = np.sqrt(4.0 - 0.3**2) + 1e-4
    second, disc = np.array([[6.3, height], [6.3 + 2.0001 * np.cos(0.7), height + 2.0001 * np.sin(0.7)]]) @ [[c, s], [-s, c]] * R
    model, state = angles([(0.0, 0.0, 0.3), (*second, 0.3 + np.pi)], [disc], damping=None)
    assert len(contacts(state).slot) == 0
    builds = state.builds
    state.clumps.motion[:, 2:5] = [[1e-5, 2e-5, 5e-5], [-1e-5, -2e-5, -1e-4]]
    state.v[10] = [-3e-5, -3e-5]
    before, scale = momentum(state)
    touched, spins = 0, []
    for _ in range(80):
        contact_forces(model, state)
        touched = max(touched, len(contacts(state).slot))
        move_free(model, state, 0.0)
        spins.append(state.clumps.motion[:, 4].copy())
    assert state.builds == builds  # masses of the static mode change with the list
    assert touched >= 3
    assert np.ptp(spins, axis=0).min() > 1e-5  # both stones were turned
    np.testing.assert_allclose(momentum(state)[0], before, atol=1e-13 * scale)


def test_quarter_turn():
    coarse, fine = quarter_turn(2500), quarter_turn(10000)
    assert fine <= 1e-8
    assert coarse / fine == pytest.approx(16.0, rel=0.2)  # second order in the step
