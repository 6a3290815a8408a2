"""A contact bond breaks when its strength is reached: at F/k in tension and in shear."""

import numpy as np
import pytest
from disc_cases import KN, KS, MU, displace, loose_discs
from verification.discrete.bonds import STEP, R, pulled

from dem_server.effects.bond import BROKEN_SHEAR, BROKEN_TENSION
from dem_server.pairs import contacts, listed_pairs


@pytest.mark.parametrize("turned", [0.0, 0.3, 1.1, 2.5])
@pytest.mark.parametrize(("stiffness", "expected"), [("disc", 6.0e-5), ("contact", 3.0e-5)])
def test_tension_breaks_within_one_step(stiffness, expected, turned):
    displacement, _, state = pulled("normal", turned, stiffness=stiffness)
    assert expected - 1e-12 <= displacement <= expected + 1.01 * STEP
    assert state.broken_tension == 1
    assert listed_pairs(state).bond_state[0] == BROKEN_TENSION
    assert not state.force.any()
    assert len(contacts(state).disc_a) == 0


@pytest.mark.parametrize("turned", [0.0, 0.3, 1.1, 2.5])
@pytest.mark.parametrize(("stiffness", "expected"), [("disc", 3.5e-4), ("contact", 1.75e-4)])
def test_shear_breaks_within_one_step(stiffness, expected, turned):
    displacement, _, state = pulled("shear", turned, stiffness=stiffness)
    assert expected * (1.0 - 1e-5) <= displacement <= expected * (1.0 + 1e-4) + STEP  # the branch turns
    assert state.broken_shear == 1
    assert listed_pairs(state).bond_state[0] == BROKEN_SHEAR


def test_a_bond_sheared_under_pressure_falls_to_friction():
    model, state = loose_discs([[0.0, 0.0], [2.0 * R - 4.0e-5, 0.0]], [R, R], bonded=True)
    while state.broken_shear == 0:
        displace(model, state, np.array([[0.0, 0.0], [0.0, STEP]]))
    pair = contacts(state)
    assert pair.normal_force[0] == pytest.approx(KN * 4.0e-5, rel=3e-2)
    assert abs(pair.shear_force[0]) == pytest.approx(MU * pair.normal_force[0], rel=1e-12)


def test_a_bond_has_no_slip_limit_before_it_breaks():
    model, state = loose_discs([[0.0, 0.0], [2.0 * R, 0.0]], [R, R], bonded=True)
    displace(model, state, np.array([[0.0, 0.0], [0.0, 2.0e-4]]))
    assert contacts(state).shear_force[0] == pytest.approx(-KS * 2.0e-4, rel=1e-4)


def test_broken_bonds_do_not_heal():
    model, state = loose_discs([[0.0, 0.0], [2.0 * R, 0.0]], [R, R], bonded=True)
    for move in (1.0e-4, -1.5e-4, 1.0e-4):
        displace(model, state, np.array([[0.0, 0.0], [move, 0.0]]))
    assert not state.force.any()
    assert state.broken_tension == 1
