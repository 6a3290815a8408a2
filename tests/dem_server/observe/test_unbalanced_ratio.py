"""Unbalanced force ratio and what the interface needs to know about the ring."""

import numpy as np
import pytest
from window_case import SQUARE, packed, soil_discs

from coupler_protocol.interface.ring import inner_share
from dem_server.coupling.ring_springs import ring_contacts
from dem_server.observe.unbalanced_ratio import unbalanced_ratio
from dem_server.pairs import contacts, listed_pairs
from dem_server.step.bonds_made import add_bonds
from dem_server.step.contact_pass import contact_forces
from dem_server.step.motion import move_free


def by_definition(model, state, gravity):
    pairs = contacts(state)
    size = np.hypot(*pairs.force.T)
    weight = gravity * state.weight
    every = weight.copy()
    np.add.at(every, pairs.disc_a, size)
    np.add.at(every, pairs.disc_b, size)
    total = state.force - np.column_stack([0.0 * weight, weight])
    free = slice(model.ring, None)
    return np.hypot(*total[free].T).max() / every[free].mean()


@pytest.mark.parametrize("gravity", [0.0, 9.81])
def test_ratio_is_largest_resultant_over_mean_force(gravity):
    model, state = packed(SQUARE, soil_discs(radius=0.06))
    for _ in range(3):
        move_free(model, state, 9.81)
        contact_forces(model, state)
    expected = by_definition(model, state, gravity)
    assert unbalanced_ratio(model, state, gravity) == pytest.approx(expected, rel=1e-12)


def test_forces_agree_with_the_contacts():
    model, state = packed(SQUARE, soil_discs(radius=0.06))
    pairs = contacts(state)
    force = np.zeros((model.count, 2))
    np.add.at(force, pairs.disc_b, pairs.force)
    np.subtract.at(force, pairs.disc_a, pairs.force)
    np.testing.assert_allclose(state.force, force, atol=1e-9 * np.abs(force).max())


def test_every_listed_ring_pair_counts_for_the_mass_rule():
    model, state = packed(SQUARE, soil_discs(radius=0.06))
    add_bonds(model, state)
    found = ring_contacts(model, state)
    pairs = listed_pairs(state)
    touching = (pairs.disc_a < model.ring) | (pairs.disc_b < model.ring)
    assert len(found.disc) == touching.sum() > model.ring
    assert found.disc.max() < model.ring
    assert set(found.kn) == {2.5e7}
    assert set(found.ks) == {1e7}
    assert not found.kr.any()


def test_inner_shares_of_a_closed_chain():
    corners = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.0, 2.0], [1.0, 1.0], [0.0, 1.0]])
    np.testing.assert_allclose(inner_share(corners), [0.25, 0.25, 0.25, 0.25, 0.75, 0.25], atol=1e-15)
    x = np.random.default_rng(0).random(9)
    star = np.exp(2j * np.pi * np.arange(9) / 9) * (1.0 + x)
    assert inner_share(np.column_stack([star.real, star.imag])).sum() == pytest.approx((9 - 2) / 2)
