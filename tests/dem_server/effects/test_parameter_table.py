"""The law as kernels take it has every column of every effect's table in a row of its own."""

import numpy as np
import pytest
from verification.discrete.discs import loose_discs

from dem_server.effects import TABLES
from dem_server.effects.bond import Bond
from dem_server.effects.friction import Friction
from dem_server.effects.parameter_table import ROWS, parameters_of, rows_of
from dem_server.effects.rolling import Rolling
from dem_server.step import scratch_rows

XY = np.array([[0.0, 0.0], [0.1, 0.0]])
OTHERS = {
    "bond": Bond(tension=2e3, shear=3e3),
    "friction": Friction(coefficient=0.4),
    "rolling": Rolling(coefficient=0.3),
    "damping": None,
}


def law_with_bonds():
    """A Law of springs, friction, bonds and rolling resistance."""
    return loose_discs(XY, np.full(2, 0.05), **OTHERS)[0].law


def test_every_column_of_every_table_has_one_row():
    assert [row for effect in TABLES for row in rows_of(effect)] == list(range(len(ROWS)))
    assert all(len(rows_of(effect)) == len(table._fields) for effect, table in TABLES.items())


def test_rows_hold_what_the_tables_hold():
    law = law_with_bonds()
    values = parameters_of(law).values
    for effect in ("spring", "friction", "bond", "rolling"):
        for row, (column, expected) in zip(rows_of(effect), getattr(law, effect)._asdict().items(), strict=True):
            assert ROWS[row] == f"{effect}.{column}"
            assert np.array_equal(values[row], expected)


def test_an_absent_effect_has_no_row_in_use():
    parameters = parameters_of(law_with_bonds())
    assert (parameters.friction, parameters.bond, parameters.rolling) == (True, True, True)
    assert (parameters.dashpot, parameters.parallel_bond, parameters.alpha) == (None, None, None)
    used = {ROWS[row].partition(".")[0] for row in parameters.present}
    assert used == {"spring", "friction", "bond", "rolling"}
    assert not parameters.values[list(rows_of("dashpot"))].any()


def test_scratch_memory_begins_with_the_parameters():
    assert scratch_rows.KN == 0
    assert (len(ROWS) - 1) * scratch_rows.LANES == scratch_rows.GLUE_RADIUS
    assert len(ROWS) * scratch_rows.LANES == scratch_rows.DX
    assert scratch_rows.SIZE == scratch_rows.GLUE_M + scratch_rows.LANES


@pytest.mark.parametrize("effect", TABLES)
def test_a_new_model_makes_its_own_table(effect):
    model, _ = loose_discs(XY, np.full(2, 0.05), **OTHERS)
    assert model.parameters is model.parameters
    table = getattr(model.law, effect)
    if table is None:
        assert getattr(model.parameters, effect) is None
    else:
        assert np.array_equal(model.parameters.values[list(rows_of(effect))], np.array(table, dtype=float))
