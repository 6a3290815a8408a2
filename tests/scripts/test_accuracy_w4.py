"""scripts/accuracy_cost.py W4: fewer messages, the same rest."""

import pytest

from tests.scripts.workload import computed

pytestmark = pytest.mark.long


def test_the_column_rests_at_the_same_place_with_fewer_messages(tmp_path):
    rows, page = computed("W4", tmp_path)
    one, ten = rows
    assert (one["every"], ten["every"]) == (1, 10)
    assert one["messages"] == 2 * one["steps"]
    assert 2 * ten["steps"] / 10 <= ten["messages"] < 2 * ten["steps"] / 5
    assert (one["error"], one["traction_error"]) == (0.0, 0.0)
    assert 0.0 < ten["error"] < 1e-3
    assert 0.0 < ten["traction_error"] < 1e-4
    assert one["gap"] < 1e-9 < ten["gap"] < 0.1
    assert one["broken"] == ten["broken"] == 0
    assert "## W4: " in page
