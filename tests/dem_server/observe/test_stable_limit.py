"""Springs of a window against the contact forces of small motions."""

import numpy as np
import pytest
from window_case import OBLIQUE, packed, packed_with_stones, rim, soil_discs

from coupler_protocol.criteria.stable_step import highest, spring_sums, stiffness_matrix
from coupler_protocol.interface.ring import build_ring
from dem_server.coupling.rim import Rim
from dem_server.coupling.ring_springs import ring_contacts
from dem_server.effects.bond import BONDED
from dem_server.effects.parallel_bond import ParallelBond
from dem_server.effects.rolling import Rolling
from dem_server.insitu.takeover import bond
from dem_server.observe.stable_limit import bodies_of, motion_of_discs, safe_limit, springs_of
from dem_server.pairs import contacts
from dem_server.step import neighbours
from dem_server.step.clumps import resultant
from dem_server.step.contact_pass import contact_forces
from dem_server.step.masses import safety
from dem_server.stones import bodies as stones

CEMENT = ParallelBond(normal_stiffness=2e9, shear_stiffness=1e9, tension=1e30, shear=1e30, radius=0.8)


PRESS = 1e-6  # [m] overlap of all contacts: small, but far more than motions, for contacts without pressure roll freely


def press(model, state):
    """All contacts bonded and pressed together a little."""
    bond(model, state)
    pairs = contacts(state)
    state.reference_gap[pairs.slot] += pairs.gap + PRESS
    state.bond_state[pairs.slot] = BONDED
    for array in (state.shear, state.rolled):
        if array is not None:
            array[:] = 0.0
    neighbours.rebuild(model, state)
    contact_forces(model, state)


def case(kind):
    """Model, State and Rim of a bonded oblique window."""
    if kind == "stones":
        model, state, found = packed_with_stones(OBLIQUE)
        model = stones.form_stones(model, state, found.outlines, "clump")
    else:
        discs = soil_discs(0.06)
        if kind == "rolling":
            discs.soil.rolling = Rolling(coefficient=1e30)
        if kind == "cement":
            discs.soil.parallel_bond = CEMENT
        model, state = packed(OBLIQUE, discs)
    press(model, state)
    return model, state, Rim(build_ring(rim(OBLIQUE), 0.03 if kind == "stones" else 0.06), "work-consistent")


@pytest.mark.parametrize("kind", ["bonds", "rolling", "cement", "stones"])
def test_stiffness_is_the_change_of_forces_in_a_small_motion(kind):
    """Nodes, discs and stones moved at random by 1e-9 m: forces on nodes and bodies are -K u."""
    model, state, side = case(kind)
    K, nodes = stiffness_matrix(springs_of(model, state, side)), 2 * len(side.nodes)
    u = 1e-9 * np.random.default_rng(1).standard_normal(K.shape[0])
    u[nodes + 2 :: 3] *= 10.0
    before = forces(model, state, side)
    motion = (motion_of_discs(model, state, side) @ u).reshape(-1, 3)
    side.move(state, u[:nodes].reshape(-1, 2))
    np.testing.assert_allclose(state.disc[: model.ring, 2:5], motion[: model.ring], rtol=1e-9, atol=1e-18)
    state.disc[model.ring :, 2:5] = motion[model.ring :]
    state.x[model.ring :] += motion[model.ring :, :2]
    contact_forces(model, state)
    change = forces(model, state, side) - before
    np.testing.assert_allclose(change, -(K @ u), atol=1e-4 * np.abs(change).max())  # forces turn with their contacts: 1e-5


def forces(model, state, side):
    """Forces on rim nodes, forces and moments on free discs and clumps, one behind the other."""
    discs = bodies_of(model, state).disc
    found = [state.load[discs[discs >= 0], :3]]
    if state.clumps is not None:
        count = len(state.clumps.motion)
        found.append([resultant(c, state.clumps, state.disc, state.load, state.weight, 0.0) for c in range(count)])
    return np.concatenate([side.nodal_forces(state).ravel(), np.concatenate(found).ravel()])


@pytest.mark.parametrize("kind", ["bonds", "rolling", "cement", "stones"])
def test_static_masses_and_mass_rule_hold_what_the_sums_ask_for(kind):
    """Bodies: 4 sf^2 times their masses; rim nodes: twice the mass rule, exactly, although both are computed in other ways."""
    model, state, side = case(kind)
    sums, bodies = spring_sums(springs_of(model, state, side, listed=True)), bodies_of(model, state)
    sf = safety(model.law.damping)
    np.testing.assert_allclose(sums.nodes, 2.0 * side.stiffness_sums(model, state), rtol=1e-9)
    assert (sums.bodies <= 4.0 * sf**2 * bodies.mass * (1 + 1e-9)).all()
    assert (sums.rotations <= 4.0 * sf**2 * bodies.inertia * (1 + 0.02)).all()  # levers of bonds that are apart
    own = np.column_stack([bodies.mass, bodies.mass, bodies.inertia]).ravel()
    mass = np.concatenate([np.full(2 * len(side.nodes), np.inf), own])
    omega2, _ = highest(stiffness_matrix(springs_of(model, state, side)), mass)
    found = safe_limit(model, state, side)
    assert found["share"] ** 2 * omega2 * 1.7 < 4.0
    assert found["what"].split()[0] in ("disc", "stone")


def test_discs_that_are_near_nothing_limit_no_step():
    """All of them lie far apart."""
    model, state, side = case("bonds")
    corner = state.x[: model.ring].min(axis=0)
    state.bond_state[:] = 0
    state.x[model.ring :] = corner - 10.0 * np.arange(1, model.count - model.ring + 1)[:, None]
    neighbours.rebuild(model, state)
    contact_forces(model, state)
    assert safe_limit(model, state, side) is None
    assert not stiffness_matrix(springs_of(model, state, side, listed=True)).toarray().any()


def test_what_hangs_on_the_ring_includes_bending():
    model, state, _ = case("rolling")
    found = ring_contacts(model, state)
    assert len(found.disc) > model.ring
    assert found.disc.max() < model.ring
    assert set(found.kn) == {2.5e7}
    assert set(found.ks) == {1e7}
    assert found.kr.min() > 0.0
    np.testing.assert_allclose(np.hypot(*found.normal.T), 1.0)
