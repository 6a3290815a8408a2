"""scripts/compile_times.py: the table of what both processes compiled."""

import pytest
from compile_times import as_text, dearest


def row(name, seconds, times=1):
    return {"function": name, "seconds": seconds, "specialisations": times}


COLD = {
    "seconds": 50.0,
    "zones": 12,
    "compiled": {"seconds": 8.0, "functions": 20, "most_expensive": [row("fdm.zones", 3.0, 2), row("fdm.move", 0.5)]},
    "windows": [
        {"name": "a", "compiled": {"seconds": 12.0, "functions": 30, "most_expensive": [row("dem.pass", 4.0)] * 12}},
        {"name": "b"},
    ],
}
WARM = {"seconds": 20.0, "zones": 12, "windows": [{"name": "a"}, {"name": "b"}]}


def test_the_dearest_functions_of_all_processes_with_their_shares():
    rows = dearest(COLD)
    assert len(rows) == 10
    assert [rows[0]["process"], rows[0]["function"], rows[0]["share"]] == ["discs a", "dem.pass", pytest.approx(0.2)]
    assert dearest(COLD | {"windows": []})[0] == row("fdm.zones", 3.0, 2) | {"process": "grid", "share": pytest.approx(0.375)}


def test_the_report_has_both_runs_and_every_process_that_compiled():
    lines = list(as_text(COLD, WARM))
    assert lines[0] == "empty cache 50.0 s, full cache 20.0 s: 30.0 s more"
    assert lines[1:3] == ["grid: 20 functions compiled, 8.0 s", "discs a: 30 functions compiled, 12.0 s"]
    assert len(lines) == 14


def test_discs_alone_are_named():
    alone = {"compiled": COLD["compiled"], "windows": [{"discs": 3}]}
    assert dearest(alone)[0]["process"] == "discs"
