"""Another law from a stage on, at single contacts: forces that stay, limits that act, bonds that begin and end."""

import numpy as np
import pytest
from verification.discrete.discs import KN, KS, MU, displace, loose_discs, soil_discs, with_held

from coupler_protocol.problems import SceneError
from dem_server.effects import law_from
from dem_server.effects.bond import BONDED, BROKEN_TENSION, Bond
from dem_server.effects.friction import Friction
from dem_server.effects.parallel_bond import ParallelBond
from dem_server.effects.rolling import Rolling
from dem_server.effects.spring import Spring
from dem_server.pairs import contacts, listed_pairs
from dem_server.step.bonds_made import add_parallel_bonds, bond_from_now_on
from dem_server.step.changed_law import forces_at_rest, with_law
from dem_server.step.masses import set_masses

R, OVERLAP = 0.03, 1e-4
STIFF = Spring(normal=20e7, shear=8e7)  # four times the springs of the discs


def two(distance=2.0 * R - OVERLAP, **changes):
    """Model and State of two discs, oblique."""
    return loose_discs([[0.0, 0.0], (distance * np.array([0.6, 0.8])).tolist()], [R, R], **changes)


def apart(state, way):
    """Velocities that part the two discs by `way` in a step."""
    return np.array([[0.0, 0.0], [0.6 * way, 0.8 * way]])


def changed(model, state, gap=None, **law):
    """The model with another law, as at the start of a stage; returns it and the number of bonds made."""
    before = model.law
    model = with_law(model, state, law_from(soil_discs(**law)))
    set_masses(model, state)
    made = bond_from_now_on(model, state, before, gap)
    forces_at_rest(model, state)
    return model, made


@pytest.mark.parametrize("reference", [True, False])
def test_springs_change_at_constant_forces(reference):
    """Fn and Fs stay; later they follow the new springs. With and without reference gaps before the change."""
    law = {"bond": None, "friction": Friction(coefficient=1.0)}
    at = [[0.0, 0.0], [0.6 * (2.0 * R - OVERLAP), 0.8 * (2.0 * R - OVERLAP)]]
    model, state = loose_discs(at, [R, R], **law) if reference else with_held(at[:1], [R], at[1:], [R], **law)
    displace(model, state, np.array([[0.0, 0.0], [-0.8e-5, 0.6e-5]]))
    before = contacts(state)
    mass = state.mass[1]
    model, _ = changed(model, state, spring=STIFF, **law)
    after = contacts(state)
    assert after.normal_force[0] == pytest.approx(KN * OVERLAP, rel=1e-4)
    np.testing.assert_allclose([after.normal_force, after.shear_force], [before.normal_force, before.shear_force], rtol=1e-9)
    assert state.mass[1] == pytest.approx(4.0 * mass)
    displace(model, state, apart(state, 0.1 * OVERLAP))
    assert contacts(state).normal_force[0] == pytest.approx(before.normal_force[0] - 4.0 * KN * 0.1 * OVERLAP, rel=1e-3)


def test_springs_too_soft_for_the_forces_are_refused():
    model, state = two(bond=None)
    with pytest.raises(SceneError, match="use stiffer springs"):
        changed(model, state, bond=None, spring=Spring(normal=5e5, shear=2e5))


def test_a_lower_friction_limits_the_shear_force_at_once():
    model, state = two(bond=None)
    displace(model, state, np.array([[0.0, 0.0], [-0.8e-3, 0.6e-3]]))
    pair = contacts(state)
    assert abs(pair.shear_force[0]) == pytest.approx(MU * pair.normal_force[0])
    _, made = changed(model, state, bond=None, friction=Friction(coefficient=0.2))
    assert abs(contacts(state).shear_force[0]) == pytest.approx(0.2 * pair.normal_force[0])
    assert made == 0


def test_friction_and_rolling_begin_and_end():
    """Without them there is no array; they begin with zero, in the next steps they act, and they leave no force."""
    smooth = {"bond": None, "friction": None}
    model, state = two(**smooth)
    assert (state.shear, state.rolled) == (None, None)
    model, _ = changed(model, state, bond=None, rolling=Rolling(coefficient=0.3))
    assert not state.shear.any()
    displace(model, state, np.zeros((2, 2)), np.array([1e-4, 0.0]))
    assert abs(contacts(state).shear_force[0]) == pytest.approx(KS * 1e-4 * R, rel=1e-2)
    assert state.rolled.any()
    model, _ = changed(model, state, **smooth)
    assert (state.shear, state.rolled) == (None, None)
    assert not state.moment.any()


@pytest.mark.parametrize(("distance", "gap", "made"), [(-OVERLAP, None, 1), (1e-4, None, 0), (1e-4, 2e-4, 1), (3e-4, 2e-4, 0)])
def test_bonds_begin_where_discs_touch_or_are_near(distance, gap, made):
    """A new bond changes no force; pulled, it resists with the spring."""
    model, state = two(2.0 * R + distance, bond=None)
    force = listed_pairs(state).normal_force.copy()
    model, number = changed(model, state, gap)
    assert number == made
    np.testing.assert_allclose(listed_pairs(state).normal_force, force, rtol=1e-12)
    displace(model, state, apart(state, 2e-5))
    expected = (force[0] - KN * 2e-5) if made else 0.0
    assert listed_pairs(state).normal_force[0] == pytest.approx(expected, rel=1e-3)
    assert state.broken_tension == 0


def test_broken_bonds_stay_broken_unless_a_gap_is_given():
    model, state = two(bonded=True)
    displace(model, state, apart(state, 2e-4))
    assert state.bond_state.tolist() == [BROKEN_TENSION]
    model, made = changed(model, state, bond=Bond(tension=1e6, shear=1e6))
    assert (made, state.bond_state.tolist()) == (0, [BROKEN_TENSION])
    model, made = changed(model, state, 2e-4, bond=Bond(tension=1e6, shear=1e6))
    assert (made, state.bond_state.tolist()) == (1, [BONDED])
    displace(model, state, apart(state, 1e-5))
    assert contacts(state).normal_force[0] == pytest.approx(-KN * 1e-5, rel=1e-3)


def test_bonds_that_end_leave_no_tension_and_are_not_broken():
    model, state = two(bonded=True)
    displace(model, state, apart(state, 1.2 * OVERLAP))
    assert contacts(state).normal_force[0] < 0.0
    model, _ = changed(model, state, bond=None)
    assert state.bond_state is None
    assert not state.force.any()
    assert (state.broken_tension, state.broken_shear) == (0, 0)


def test_new_strengths_apply_to_bonds_that_exist():
    model, state = two(bonded=True)
    displace(model, state, apart(state, 1.2 * OVERLAP))
    changed(model, state, bond=Bond(tension=100.0, shear=1e4))
    assert state.bond_state.tolist() == [BROKEN_TENSION]
    assert not state.force.any()


def test_parallel_bonds_keep_their_force():
    cement = ParallelBond(normal_stiffness=1e9, shear_stiffness=5e8, tension=1e9, shear=1e9, radius=0.8)
    law = {"bond": None, "friction": None}
    model, state = two(parallel_bond=cement, **law)
    add_parallel_bonds(model, state)
    displace(model, state, apart(state, 1e-5))
    before = state.parallel.normal[0]
    assert before == pytest.approx(-1e9 * 2.0 * 0.8 * R * 1e-5, rel=1e-3)
    other = cement.model_copy(update={"normal_stiffness": 3e9, "radius": 0.4})
    model, made = changed(model, state, parallel_bond=other, **law)
    assert made == 0
    assert state.parallel.normal[0] == pytest.approx(before, rel=1e-9)
    displace(model, state, apart(state, 1e-5))
    assert state.parallel.normal[0] == pytest.approx(2.5 * before, rel=1e-3)
    model, _ = changed(model, state, **law)
    assert state.parallel is None
    assert contacts(state).normal_force[0] == pytest.approx(KN * (OVERLAP - 2e-5), rel=1e-3)
