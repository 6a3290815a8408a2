"""scripts/studies/interval_study.py: fewer messages, the same rest, and what a line's latency costs at least."""

import json

import interval_study
import pytest

pytestmark = [pytest.mark.long, pytest.mark.trial]


def test_the_column_rests_at_the_same_place_with_fewer_messages(tmp_path, capsys):
    page = tmp_path / "page.md"
    assert interval_study.main(["--fast", "--json", str(tmp_path / "rows.json"), "--page", str(page)]) == 0
    one, ten = json.loads((tmp_path / "rows.json").read_text())
    assert (one["every"], ten["every"]) == (1, 10)
    assert one["messages"] == 2 * one["steps"]
    assert 2 * ten["steps"] / 10 <= ten["messages"] < 2 * ten["steps"] / 5
    assert (one["displacement_error"], one["traction_error"]) == (0.0, 0.0)
    assert 0.0 < ten["displacement_error"] < 1e-3
    assert 0.0 < ten["traction_error"] < 1e-4
    assert one["broken"] == ten["broken"] == 0
    for row in (one, ten):  # the first FORCE of the first stage came before its time began
        assert row["seconds_1"] >= 1e-3 * (row["messages"] - 2)
    assert "s at 1 ms" in capsys.readouterr().out
    assert not page.exists()
