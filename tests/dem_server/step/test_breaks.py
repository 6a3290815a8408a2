"""Rows of broken bonds: each break once, with its place and mode, whatever becomes of the list of pairs."""

import numpy as np
import pytest

from dem_server.effects.bond import BONDED, BROKEN_SHEAR, BROKEN_TENSION
from dem_server.effects.parallel_bond import ParallelBond
from dem_server.step import bonds_made, breaks
from dem_server.step.neighbours import rebuild
from tests.physics.disc_cases import displace, loose_discs

R = 0.03
TURN = np.array([np.cos(0.7), np.sin(0.7)])


@pytest.fixture
def pair():
    model, state = loose_discs(np.array([0.0, 2.0, 3.8])[:, None] * R * TURN, [R, R, 0.8 * R], bonded=True)
    assert breaks.room(state) == 2
    return model, state


def pull(model, state, steps=3, way=TURN, disc=2):
    """Moves one disc away."""
    for _ in range(steps):
        displace(model, state, np.where(np.arange(3)[:, None] == disc, 3e-5 * way, 0.0))


def test_a_break_is_taken_once_with_its_place_and_mode(pair):
    model, state = pair
    assert breaks.take(state) is None
    pull(model, state)
    assert state.broken_tension == 1
    (found,) = breaks.take(state)
    np.testing.assert_allclose(found[[breaks.PLACE_X, breaks.PLACE_Y]], (3.0 * R + 4.5e-5) * TURN, rtol=1e-6)
    np.testing.assert_allclose(found[[breaks.NORMAL_X, breaks.NORMAL_Y]], TURN, rtol=1e-9)
    assert found[breaks.SIZE] == pytest.approx(1.6 * R)
    assert found[[breaks.FIRST, breaks.SECOND, breaks.MODE, breaks.KIND]].tolist() == [1, 2, BROKEN_TENSION, breaks.CONTACT_BOND]
    assert breaks.take(state) is None
    assert breaks.room(state) == 1
    across = np.array([-TURN[1], TURN[0]])
    pull(model, state, 13, way=across, disc=0)
    (found,) = breaks.take(state)
    assert found[[breaks.FIRST, breaks.SECOND, breaks.MODE]].tolist() == [0, 1, BROKEN_SHEAR]
    columns = breaks.as_columns(found[None], model.material, (10.0, 20.0))
    np.testing.assert_allclose(columns["place"], found[None, [breaks.PLACE_X, breaks.PLACE_Y]] + (10.0, 20.0))
    assert columns["material_a"].tolist() == columns["material_b"].tolist() == [1]


def test_a_pair_that_breaks_and_is_lost_by_the_list_is_not_missed(pair):
    """The bond breaks, the disc goes far away, and lists are built: nobody has looked in between."""
    model, state = pair
    pull(model, state)
    state.x[2] += 10.0 * R * TURN
    rebuild(model, state)
    assert len(state.first) == 1
    rebuild(model, state)
    (found,) = breaks.take(state)
    assert found[[breaks.FIRST, breaks.SECOND, breaks.MODE]].tolist() == [1, 2, BROKEN_TENSION]


def test_a_pair_that_is_bonded_again_can_break_again(pair):
    model, state = pair
    pull(model, state)
    assert len(breaks.take(state)) == 1
    pull(model, state, 4, way=-TURN)
    bonds_made.add_bonds(model, state)
    assert (state.bond_state == BONDED).all()
    pull(model, state, 6)
    assert state.broken_tension == 2
    (found,) = breaks.take(state)
    assert found[[breaks.FIRST, breaks.SECOND]].tolist() == [1, 2]


def test_parallel_bonds_are_told_apart():
    glue = ParallelBond(normal_stiffness=1e9, shear_stiffness=1e9, tension=1e4, shear=1e9)
    model, state = loose_discs([[0.0, 0.0], [2.0 * R - 1e-9, 0.0]], [R, R], bond=None, parallel_bond=glue)
    assert bonds_made.add_parallel_bonds(model, state) == 1
    displace(model, state, np.array([[0.0, 0.0], [2e-5, 0.0]]))
    (found,) = breaks.take(state)
    assert found[[breaks.MODE, breaks.KIND]].tolist() == [BROKEN_TENSION, breaks.PARALLEL_BOND]


def test_without_bonds_there_is_nothing():
    _, state = loose_discs([[0.0, 0.0], [2.0 * R, 0.0]], [R, R], bond=None)
    assert not breaks.has_bonds(state)
    assert state.breaks is None
    assert state.bond_reported is None
    assert breaks.take(state) is None
