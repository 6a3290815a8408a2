"""Rigid stones: collisions conserve momentum and moment of momentum, and a rigid motion of all changes no force."""

import numpy as np
import pytest
from disc_cases import KN, loose_discs

from dem_server import stones
from dem_server.clumps import place_members
from dem_server.contacts import contact_forces
from dem_server.effects.bond import Bond
from dem_server.effects.friction import Friction
from dem_server.effects.spring import Spring
from dem_server.fields import contacts, listed_pairs
from dem_server.motion import move_free

R = 0.03
ANGLE = R * np.array([[-1.0, -1.0], [5.0, -1.0], [5.0, 1.0], [1.0, 1.0], [1.0, 5.0], [-1.0, 5.0]])  # of five discs
FIVE = R * np.array([[0.0, 0.0], [2.0, 0.0], [4.0, 0.0], [0.0, 2.0], [0.0, 4.0]])


class Stone:
    """Material of the stones, smooth where `friction` is 0."""

    density = 2700.0
    spring = Spring(normal=5.0e8, shear=5.0e8)
    friction = Friction(coefficient=1.0)
    bond = Bond(tension=1e9, shear=1e9)


def angles(places, loose=(), **changes):
    """Stones of five discs at `places` (x, y, turned by), and loose discs of soil, made into clumps."""
    outlines, xy = [], []
    for x, y, turn in places:
        c, s = np.cos(turn), np.sin(turn)
        M = np.array([[c, s], [-s, c]])
        outlines.append(ANGLE @ M + [x, y])
        xy.append(FIVE @ M + [x, y])
    xy = np.vstack([*xy, *np.reshape(loose, (-1, 2))])
    model, state = loose_discs(xy, np.full(len(xy), R), stone=Stone(), **changes)
    stones.mark(model, state, outlines, Stone.density)
    return stones.make(model, state, outlines, "clump"), state


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


def turn(steps):
    """Largest change of a contact force, over kn R, after a quarter turn of everything in so many steps."""
    loose = [[0.0925, 0.092], [0.15, 0.09]]
    glue = Bond(tension=1e9, shear=1e9)
    model, state = angles([(0.0, 0.0, 0.0), (0.24, 0.148, np.pi)], loose, bond=glue)
    state.bond_state[np.arange(state.partner.shape[1]) < state.used[:, None]] = 1
    contact_forces(model, state)
    pairs = listed_pairs(state)
    state.shear.ravel()[pairs.slot] = np.random.default_rng(0).normal(0.0, 300.0, len(pairs.slot))
    before = np.column_stack([pairs.normal_force, state.shear.ravel()[pairs.slot]])
    clumps, centre = state.clumps, np.array([0.4, -0.2])
    body, disc = clumps.motion[:, :2].copy(), state.x[10:].copy()
    for step in range(1, steps + 1):
        angle = 0.5 * np.pi * step / steps
        c, s = np.cos(angle), np.sin(angle)
        M = np.array([[c, s], [-s, c]])
        for now, was, velocity in ((clumps.motion[:, :2], body, clumps.motion[:, 2:4]), (state.x[10:], disc, state.v[10:])):
            velocity[:] = centre + (was - centre) @ M - now
            now[:] = centre + (was - centre) @ M
        clumps.motion[:, 4], clumps.motion[:, 5], state.spin[10:] = 0.5 * np.pi / steps, angle, 0.5 * np.pi / steps
        for k in range(2):
            place_members(k, clumps, state.disc, state.angle, 1.0)
        contact_forces(model, state)
    pairs = listed_pairs(state)
    assert len(pairs.slot) == len(before) >= 4
    after = np.column_stack([pairs.normal_force, pairs.shear_force])
    return np.abs(np.sort(after, axis=0) - np.sort(before, axis=0)).max() / (KN * R)


def test_quarter_turn():
    coarse, fine = turn(2500), turn(10000)
    assert fine <= 1e-8
    assert coarse / fine == pytest.approx(16.0, rel=0.2)  # second order in the step
