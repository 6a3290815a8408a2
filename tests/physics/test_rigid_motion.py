"""A rigid motion of ring and discs leaves every contact force as it was: the contact law is objective."""

import numpy as np
import pytest
from disc_cases import KN, loose_discs

from dem_server.effects.bond import Bond
from dem_server.pairs import listed_pairs
from dem_server.step.contact_pass import contact_forces

R = 0.03


def stressed_discs():
    """Discs with normal and shear forces of all sizes, bonded so that nothing slips."""
    rng = np.random.default_rng(5)
    side = np.arange(9) * 1.99 * R
    xy = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2) + rng.normal(0.0, 0.003 * R, (81, 2))
    glue = Bond(tension=1e9, shear=1e9)
    model, state = loose_discs(xy, R * rng.uniform(0.99, 1.01, 81), bonded=True, bond=glue)
    state.shear[:] = rng.normal(0.0, 300.0, len(state.shear))
    contact_forces(model, state)
    assert state.broken_tension == 0
    return model, state


def forces(state):
    """Normal and shear forces of all pairs, in an order that does not depend on the list."""
    pairs = listed_pairs(state)
    order = np.lexsort((np.maximum(pairs.disc_a, pairs.disc_b), np.minimum(pairs.disc_a, pairs.disc_b)))
    return np.column_stack([pairs.normal_force, pairs.shear_force])[order]


def test_translation():
    model, state = stressed_discs()
    before = forces(state)
    state.v[:] = [3.1e-5, -1.7e-5]
    for _ in range(2000):
        state.x[:] += state.v
        contact_forces(model, state)
    assert state.builds > 5
    np.testing.assert_allclose(forces(state), before, atol=1e-12 * KN * R)


def turn(steps):
    """Largest change of a contact force, over kn R, after a quarter turn in so many steps."""
    model, state = stressed_discs()
    before = forces(state)
    centre, start = np.array([0.4, -0.2]), state.x.copy()
    for step in range(1, steps + 1):
        angle = 0.5 * np.pi * step / steps
        c, s = np.cos(angle), np.sin(angle)
        there = centre + (start - centre) @ np.array([[c, s], [-s, c]])
        state.v[:] = there - state.x
        state.x[:] = there
        state.spin[:] = 0.5 * np.pi / steps
        contact_forces(model, state)
    return np.abs(forces(state) - before).max() / (KN * R)


def test_quarter_turn():
    coarse, fine = turn(2500), turn(10000)
    assert fine <= 1e-8
    assert coarse / fine == pytest.approx(16.0, rel=0.1)  # second order in the step
