"""The benchmark of several windows compares a coupled step with its slowest process (no seconds asserted)."""

import json

import bench_windows
import pytest
from bench.timing_rows import bounds
from pages import plain

from coupler_protocol.scene.of_window import of_windows
from tests.commands import run_script


@pytest.mark.parametrize(
    ("cores", "bound", "over"),
    [(4, 90.0, 1.2), (2, 90.0, 1.2), (1, 160.0, 0.675)],
)
def test_the_slowest_process_bounds_a_step_or_all_of_them_where_cores_are_few(cores, bound, over):
    found = bench_windows.compared("name", [108.0, 100.0, 120.0], {"grid": 40.0, "w1": 30.0, "w2": 90.0}, cores)
    assert (found["windows"], found["slowest"], found["by"], found["value"]) == (2, 90.0, "w2", 108.0)
    assert (found["bound"], found["over"]) == (pytest.approx(bound), pytest.approx(over))
    assert bounds([100.0, 108.0, 120.0])[0] <= found["value"]
    assert "w2" in plain([found], bench_windows.COLUMNS)


def test_the_last_window_of_the_last_ground_has_four_times_as_many_discs():
    scene = bench_windows.ground(3, 0.1, smaller=True)
    assert [own.discs.radius for _, own in of_windows(scene)] == [0.1, 0.1, 0.05]
    assert len(bench_windows.ground(2, 0.1).window) == 2


@pytest.mark.trial
@pytest.mark.long
def test_every_ground_is_measured(tmp_path):
    words = ("--most", "2", "--steps", "10", "--repeats", "1", "--radius", "0.12")
    done = run_script("bench_windows.py", *words, "--json", tmp_path / "rows.json", "--page", tmp_path / "page.md")
    assert done.returncode == 0, done.stderr
    rows = json.loads((tmp_path / "rows.json").read_text())
    assert [row["windows"] for row in rows] == [1, 2, 2]
    assert [sorted(row["alone"]) for row in rows] == [["grid", "w1"], *[["grid", "w1", "w2"]] * 2]
    for row in rows:
        assert row["by"] in row["alone"]
        assert row["slowest"] == max(row["alone"].values()) <= row["bound"]
        assert row["companion"]["triad_GB_per_s"] > 0.0
    assert "the last one finer" in (tmp_path / "page.md").read_text()
