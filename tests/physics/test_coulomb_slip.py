"""Coulomb: the shear force of an unbonded contact follows its spring up to mu Fn and stays there."""

import numpy as np
import pytest
from disc_cases import KN, KS, MU, displace, loose_discs

from dem_server.pairs import contacts

R, OVERLAP = 0.03, 1.0e-4


@pytest.mark.parametrize("turned", [0.0, 0.7, 2.0])
def test_sticks_then_slides(turned):
    along = np.array([np.cos(turned), np.sin(turned)])
    across = np.array([-along[1], along[0]])
    model, state = loose_discs([[0.0, 0.0], (2.0 * R - OVERLAP) * along], [R, R], bond=None)
    limit = MU * KN * OVERLAP
    slip = 0.0
    while slip < 1.5 * limit / KS:
        displace(model, state, np.array([[0.0, 0.0], 1.0e-6 * across]))
        slip += 1.0e-6
        pair = contacts(state)
        elastic = min(KS * slip, MU * pair.normal_force[0])
        assert pair.shear_force[0] == pytest.approx(-elastic, rel=1e-4)


def test_friction_opposes_rolling_levers():
    """Two discs spun against each other slip by w (ri + rj) a step, like gears not at all."""
    model, state = loose_discs([[0.0, 0.0], [2.0 * R, 0.0]], [R, R], bonded=True)
    displace(model, state, np.zeros((2, 2)), np.array([1e-4, -1e-4]))
    assert contacts(state).shear_force[0] == 0.0
    displace(model, state, np.zeros((2, 2)), np.array([1e-4, 1e-4]))
    assert contacts(state).shear_force[0] == pytest.approx(KS * 1e-4 * 2.0 * R, rel=1e-12)
    np.testing.assert_allclose(state.moment, -KS * 2e-4 * R * R, rtol=1e-12)


def test_without_friction_and_bond_there_is_no_shear():
    model, state = loose_discs([[0.0, 0.0], [2.0 * R - OVERLAP, 0.0]], [R, R], bond=None, friction=None)
    displace(model, state, np.array([[0.0, 0.0], [0.0, 1e-5]]))
    assert state.shear is None
    assert contacts(state).shear_force[0] == 0.0
    assert state.moment.tolist() == [0.0, 0.0]


def test_history_is_lost_at_separation():
    model, state = loose_discs([[0.0, 0.0], [2.0 * R - OVERLAP, 0.0]], [R, R], bond=None)
    displace(model, state, np.array([[0.0, 0.0], [0.0, 1e-5]]))
    before = abs(contacts(state).shear_force[0])
    displace(model, state, np.array([[0.0, 0.0], [2.0 * OVERLAP, 0.0]]))
    displace(model, state, np.array([[0.0, 0.0], [-2.0 * OVERLAP, 0.0]]))
    assert abs(contacts(state).shear_force[0]) < 0.01 * before
