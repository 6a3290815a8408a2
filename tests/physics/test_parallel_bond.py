"""Parallel bonds: beams bend as beams do, and break at the stress of their strength."""

import numpy as np
import pytest
from disc_cases import displace, loose_discs
from verification.discrete.beam import cantilever
from verification.discrete.bonds import KN, KS, SHEAR, TENSION, R, cement, everywhere, moved

from dem_server.effects.bond import BROKEN_SHEAR, BROKEN_TENSION
from dem_server.pairs import listed_pairs
from dem_server.step.bonds_made import add_parallel_bonds
from dem_server.step.neighbours import rebuild


@pytest.mark.parametrize("radius", [1.0, 0.5])
@pytest.mark.parametrize("turned", [0.0, 0.6])
def test_cantilever(turned, radius):
    found, expected = cantilever(10, turned, radius)
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-4 * expected[0])


STEP = 1.0e-8


@pytest.mark.parametrize("radius", [1.0, 0.4])
def test_breaks_in_tension(radius):
    steps, state = moved([[0.0, 0.0], [STEP, 0.0]], [0.0, 0.0], radius=radius)
    assert steps - 1 <= TENSION / KN / STEP <= steps + 1e-6
    assert (state.broken_tension, state.broken_shear) == (1, 0)
    assert state.parallel.state[listed_pairs(state).slot[0]] == BROKEN_TENSION
    assert not state.load.any()


def test_breaks_in_shear():
    steps, state = moved([[0.0, 0.0], [0.0, 10.0 * STEP]], [0.0, 0.0], tension=1e9)
    assert abs(steps - SHEAR / KS / (10.0 * STEP)) <= 1.0
    assert state.parallel.state[listed_pairs(state).slot[0]] == BROKEN_SHEAR
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


def test_history_survives_a_new_list():
    """Another pair before it in the list does not take it for its own."""
    model, state = loose_discs(
        [[1.0, 0.0], [0.0, 0.0], [2.0 * R, 0.0]], [R, R, R], bond=None, friction=None, parallel_bond=cement(tension=1e9)
    )
    add_parallel_bonds(model, state, everywhere)
    displace(model, state, np.zeros((3, 2)), np.array([0.0, -1e-5, 1e-5]))
    before = [float(array[0]) for array in state.parallel]
    assert before[-1] < 0.0
    state.x[0] = [-2.0 * R, 0.0]
    rebuild(model, state)
    assert state.first.tolist() == [0, 1]
    assert [float(array[1]) for array in state.parallel] == before
    assert not any(array[0] for array in state.parallel)
