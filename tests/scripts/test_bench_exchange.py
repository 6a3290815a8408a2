"""The benchmark of the exchange runs on a small scene and reports all it promises (no seconds asserted)."""

import json

import pytest

from tests.commands import run_script

pytestmark = pytest.mark.long

NAMES = ["coupled step", "kernels of the grid", "kernels of the discs", "wire"]
BY_STEPS = ["grid alone, one by one", "discs alone, one by one", "link", "bound: slower kernels + wire"]


def test_all_times_are_measured(tmp_path, configs):
    words = [configs / "quick_slope.toml", "--steps", "1000", "--repeats", "1", "--json", tmp_path / "rows.json"]
    done = run_script("bench_exchange.py", *words, timeout=200)
    assert done.returncode == 0, done.stderr
    rows = json.loads((tmp_path / "rows.json").read_text())
    assert [row["name"] for row in rows][:8] == NAMES + BY_STEPS
    assert [row["name"] for row in rows][-1] == "coupled step with frames over without"
    assert "recording stalls the loop by" in done.stdout
    assert all(row["value"] > 0.0 for row in rows)
    assert all(row["companion"]["triad_GB_per_s"] > 0.0 for row in rows)
    assert {"name", "size", "threads", "value", "unit", "repeats", "spread", "companion", "note"} <= rows[0].keys()
