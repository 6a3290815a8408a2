"""An effect that is off takes no memory, one that is on takes what its history needs."""

import numpy as np
import pytest
from disc_cases import loose_discs

from dem_server.effects.bond import Bond
from dem_server.effects.dashpot import Dashpot
from dem_server.effects.friction import Friction
from dem_server.effects.parallel_bond import ParallelBond
from dem_server.effects.rolling import Rolling
from dem_server.step import neighbours

COUNT = 20
SPRING_ALONE = {"friction": None, "bond": None}
TABLES = {
    "friction": Friction(coefficient=0.5),
    "bond": Bond(tension=1.0, shear=1.0),
    "rolling": Rolling(coefficient=0.1),
    "dashpot": Dashpot(normal=0.1),
    "parallel_bond": ParallelBond(normal_stiffness=1e9, shear_stiffness=1e9, tension=1.0, shear=1.0),
}


def of_a_pair(**tables):
    """Bytes a pair after a rebuild of the list."""
    model, state = loose_discs(np.outer(np.arange(COUNT), [0.06, 0.0]), np.full(COUNT, 0.03), **SPRING_ALONE | tables)
    neighbours.rebuild(model, state)
    pairs = len(state.first)
    assert pairs == COUNT - 1
    kept = [a for a in vars(state).values() if isinstance(a, np.ndarray) and a.shape == (pairs,)]
    kept += [] if state.parallel is None else list(state.parallel)
    return sum(a.nbytes for a in kept) / pairs


BASE = 4 + 4 + 4 + 8 + 8  # both discs, kind, normal force, reference gap


@pytest.mark.parametrize(
    ("effect", "history"),
    [("friction", 8), ("bond", 8 + 1 + 1), ("rolling", 8), ("dashpot", 8 + 8), ("parallel_bond", 8 + 1 + 1 + 4 * 8)],
)
def test_bytes_of_each_effect(effect, history):
    """All that can shear share one array of 8 bytes a pair; a bond has its state, and whether its break was reported."""
    assert of_a_pair() == BASE
    assert of_a_pair(**{effect: TABLES[effect]}) == BASE + history


def test_bytes_of_all():
    assert of_a_pair(**TABLES) == BASE + 8 + 2 + 8 + 8 + 34
