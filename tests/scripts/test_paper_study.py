"""The study runs on the coarse slope and reports all it promises; its means and scatters are those of directions."""

import importlib.util
import json
from pathlib import Path

import pytest

from tests.commands import run_script

SCRIPT = Path(__file__).resolve().parents[2] / "scripts" / "studies" / "paper_study.py"


@pytest.fixture(scope="module")
def study():
    """The script as a module."""
    spec = importlib.util.spec_from_file_location("paper_study", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.long
def test_every_case_and_state_is_reported(tmp_path):
    pytest.importorskip("matplotlib")
    pytest.importorskip("cmcrameri")
    words = ["--fast", "--seeds", "1", "--json", tmp_path / "study.json", "--pictures", tmp_path]
    done = run_script("studies/paper_study.py", *words)
    assert done.returncode == 0, done.stderr
    results = json.loads((tmp_path / "study.json").read_text())
    assert list(results) == ["stressed", "unstressed", "paper mapping", "light discs"]
    stressed, unstressed = (results[case][0]["moments"]["a"]["fabric"]["all"] for case in ("stressed", "unstressed"))
    assert stressed["a_n"] > 0.4  # the slope's stress
    assert unstressed["a_n"] < 0.2  # the packing's, which is the same in all directions
    assert stressed["half_width"]["a_n"] < 0.1
    assert len({results[case][0]["scene_hash"] for case in results}) == 4
    assert set(results["stressed"][0]["states"]) == set("abcd")
    assert {path.name for path in tmp_path.glob("*.png")} == {"paper_states.png", "paper_fabric.png"}
    for title in ("When the states are reached", "Contact normals", "Normal forces", "By kind of contact", "First seed, forces"):
        assert title in done.stdout


def test_directions_are_averaged_as_axes(study):
    assert study.mean_and_scatter([170.0, 10.0], axial=True) == pytest.approx((0.0, 200.0**0.5))
    assert study.mean_and_scatter([80.0, 90.0, 100.0], axial=True) == pytest.approx((90.0, 10.0))
    assert study.mean_and_scatter([1.0, 3.0]) == pytest.approx((2.0, 2.0**0.5))
    assert study.mean_and_scatter([3.0]) == (3.0, None)


def test_cells_of_the_tables(study):
    def row(*values):
        fabric = dict(zip(study.QUANTITIES, values, strict=True))
        return {"moments": {"d": {"fabric": {"all": fabric, "stone-stone": None}}, "c": None}}

    rows = [row(0.2, 80.0, 0.5, 84.0), row(0.3, 100.0, 0.5, 84.0)]
    assert study.pair(rows, "d", "all", "a", "theta_a") == "0.25 ± 0.07, 90 ± 14°"
    assert study.pair(rows, "d", "stone-stone", "a", "theta_a") == "-"  # too few contacts
    assert study.pair(rows, "c", "all", "a", "theta_a") == "-"  # not reached
    assert study.pair(rows[:1], "d", "all", "a_n", "theta_n") == "0.50, 84°"
