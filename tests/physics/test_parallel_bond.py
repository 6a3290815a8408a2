"""Parallel bonds: beams bend as beams do, and break at the stress of their strength."""

import numpy as np
import pytest
from disc_cases import displace, loose_discs, with_held

from dem_server.balance import unbalanced_ratio
from dem_server.bonding import add_parallel_bonds
from dem_server.cycle import advance
from dem_server.effects.bond import BROKEN_SHEAR, BROKEN_TENSION
from dem_server.effects.parallel_bond import ParallelBond
from dem_server.fields import listed_pairs
from dem_server.neighbours import carry_over, like

FORCE = 0.01  # at the end of the beam [N]
R, KN, KS = 0.03, 4.0e9, 1.5e9  # radius [m], stiffness of the bonds over area [Pa/m]
TENSION, SHEAR = 2.0e5, 3.0e5


def cement(**changes):
    strengths = {"tension": TENSION, "shear": SHEAR, "radius": 1.0} | changes
    return ParallelBond(normal_stiffness=KN, shear_stiffness=KS, **strengths)


def everywhere(pairs):
    return np.ones(len(pairs.slot), dtype=bool)


def cantilever(discs, turned, radius):
    """Way of the end of a row of discs, the first one held, under the force FORCE downwards; and their distance."""
    along, gap = np.array([np.cos(turned), np.sin(turned)]), 0.1 * R  # apart: bonds alone act
    xy = np.outer(np.arange(discs + 1) * (2.0 * R + gap), along)
    glue = cement(tension=1e9, shear=1e9, radius=radius)
    model, state = with_held(xy[:1], [R], xy[1:], np.full(discs, R), bond=None, friction=None, parallel_bond=glue)
    assert add_parallel_bonds(model, state, everywhere) == discs
    state.weight[:] = 0.0
    state.weight[-1] = FORCE
    for _ in range(200):
        advance(model, state, 1.0, 1000)
        if unbalanced_ratio(model, state, 1.0) < 1e-9:
            break
    return state.displacement[-1], 2.0 * R + gap


@pytest.mark.parametrize("radius", [1.0, 0.5])
@pytest.mark.parametrize("turned", [0.0, 0.6])
def test_cantilever(turned, radius):
    """P L^3 / 3 E J + P L / (ks' A / s) with E = kn' s; bending at N places instead of everywhere: 1 - 1 / 4 N^2."""
    discs = 10
    way, s = cantilever(discs, turned, radius)
    length, area, second = discs * s, 2.0 * R * radius, 2.0 / 3.0 * (R * radius) ** 3
    across, axial = FORCE * np.cos(turned), -FORCE * np.sin(turned)
    bending = across * length**3 / (3.0 * KN * s * second) * (1.0 - 1.0 / (4.0 * discs**2))
    expected = bending + across * discs / (KS * area), axial * discs / (KN * area)
    found = -way @ [-np.sin(turned), np.cos(turned)], way @ [np.cos(turned), np.sin(turned)]
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-4 * expected[0])


def moved(velocity, spin, **changes):
    """Steps until a bond of two discs in touch breaks, and the State."""
    model, state = loose_discs(
        [[0.1, 0.2], [0.1 + 2.0 * R, 0.2]], [R, R], bond=None, friction=None, parallel_bond=cement(**changes)
    )
    add_parallel_bonds(model, state, everywhere)
    for step in range(1, 10000):
        displace(model, state, np.array(velocity), np.array(spin))
        if state.broken_tension + state.broken_shear:
            return step, state
    raise AssertionError("the bond holds")


STEP = 1.0e-8


@pytest.mark.parametrize("radius", [1.0, 0.4])
def test_breaks_in_tension(radius):
    steps, state = moved([[0.0, 0.0], [STEP, 0.0]], [0.0, 0.0], radius=radius)
    assert steps - 1 <= TENSION / KN / STEP <= steps + 1e-6
    assert (state.broken_tension, state.broken_shear) == (1, 0)
    assert state.parallel.state.ravel()[listed_pairs(state).slot[0]] == BROKEN_TENSION
    assert not state.load.any()


def test_breaks_in_shear():
    steps, state = moved([[0.0, 0.0], [0.0, 10.0 * STEP]], [0.0, 0.0], tension=1e9)
    assert abs(steps - SHEAR / KS / (10.0 * STEP)) <= 1.0
    assert state.parallel.state.ravel()[listed_pairs(state).slot[0]] == BROKEN_SHEAR
    assert (state.broken_tension, state.broken_shear) == (0, 1)


@pytest.mark.parametrize("radius", [1.0, 0.4])
def test_breaks_in_bending(radius):
    """sigma = kn' R turn."""
    turn = STEP / (radius * R)
    steps, state = moved(np.zeros((2, 2)), [-0.5 * turn, 0.5 * turn], radius=radius)
    assert steps - 1 <= TENSION / (KN * radius * R) / turn <= steps + 1e-6
    assert state.broken_tension == 1


def test_bending_and_tension_add_up():
    turn = 0.5 * STEP / R
    steps, _ = moved([[0.0, 0.0], [0.5 * STEP, 0.0]], [-0.5 * turn, 0.5 * turn])
    assert abs(steps - TENSION / KN / STEP) <= 1.0


def test_a_bond_is_made_without_stress_and_carries_compression_too():
    overlap = 1e-5
    model, state = loose_discs(
        [[0.0, 0.0], [2.0 * R - overlap, 0.0]], [R, R], bond=None, friction=None, parallel_bond=cement(radius=0.5)
    )
    before = state.force.copy()
    assert add_parallel_bonds(model, state) == 1
    displace(model, state, np.zeros((2, 2)))
    np.testing.assert_allclose(state.force, before, rtol=1e-12)
    displace(model, state, np.array([[0.0, 0.0], [-1e-6, 0.0]]))
    assert state.force[1, 0] == pytest.approx(2.5e7 * (overlap + 1e-6) + KN * R * 1e-6, rel=1e-9)


def test_history_survives_a_new_list_in_either_order():
    """Moments act on the second disc of a pair: where the slot changes hands their sign must change."""
    model, state = loose_discs(
        [[0.0, 0.0], [2.0 * R, 0.0]], [R, R], bond=None, friction=None, parallel_bond=cement(tension=1e9)
    )
    add_parallel_bonds(model, state, everywhere)
    displace(model, state, np.zeros((2, 2)), np.array([-1e-5, 1e-5]))
    bonds = state.parallel
    assert bonds.moment[0, 0] < 0.0
    new = like(bonds, state.partner.shape[1])
    used, partner = np.array([0, 1], dtype=np.int32), np.zeros_like(state.partner)
    assert carry_over(state.used, state.partner, *bonds, None, used, partner, *new)
    assert new[-1][1, 0] == -bonds.moment[0, 0]
    assert new[0][1, 0] == bonds.state[0, 0]
