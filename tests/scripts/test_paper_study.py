"""The study runs on the coarse slope and reports all it promises; its means and scatters are those of directions."""

import importlib.util
import json
from pathlib import Path
from types import SimpleNamespace

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


@pytest.mark.trial
@pytest.mark.long
def test_every_case_and_state_is_reported(tmp_path):
    pytest.importorskip("matplotlib")
    pytest.importorskip("cmcrameri")
    cases = "stressed", "unstressed", "paper's way", "light discs"  # the third has the paper's mapping as well
    words = ["--fast", "--seeds", "1", "--cases", *cases, "--json", tmp_path / "study.json", "--pictures", tmp_path]
    done = run_script("studies/paper_study.py", *words)
    assert done.returncode == 0, done.stderr
    results = json.loads((tmp_path / "study.json").read_text())
    assert tuple(results) == cases
    stressed, unstressed = (results[case][0]["moments"]["a"]["fabric"]["all"] for case in ("stressed", "unstressed"))
    assert stressed["a_n"] > 0.4  # the slope's stress
    assert unstressed["a_n"] < 0.2  # the packing's, which is the same in all directions
    assert stressed["half_width"]["a_n"] < 0.1
    assert len({results[case][0]["scene_hash"] for case in results}) == 4
    assert set(results["stressed"][0]["states"]) == set("abcd")
    assert {path.name for path in tmp_path.glob("*.png")} == {"paper_states.png", "paper_fabric.png"}
    for title in ("When the states are reached", "Contact normals", "Normal forces", "By kind of contact", "First seed, forces"):
        assert title in done.stdout


def test_finished_runs_are_read_again(study, tmp_path, monkeypatch):
    """A run of another scene, or one that did not reach its end, is computed again."""
    scene = study.colluvium.Scene.read(study.CONFIGS / "quick_slope.toml")
    assert study.finished(scene, tmp_path) is None
    infos, closed = [], []
    monkeypatch.setattr(
        study.colluvium, "open_run", lambda folder: SimpleNamespace(info=infos[-1], close=lambda: closed.append(folder))
    )
    (tmp_path / "run.json").touch()
    infos.append({"scene_hash": scene.digest(), "exit_code": 0})
    assert study.finished(scene, tmp_path).info is infos[-1]
    for other in ({"scene_hash": "of another", "exit_code": 0}, {"scene_hash": scene.digest(), "exit_code": 130}):
        infos.append(other)
        assert study.finished(scene, tmp_path) is None
    assert closed == [tmp_path, tmp_path]


def test_the_papers_way_is_what_its_name_says(study):
    scene = study.colluvium.Scene.read(study.CONFIGS / "paper_slope.toml", study.PAPERS_WAY)
    assert (scene.discs.packing, scene.stones.body, scene.coupling.mapping) == ("inward", "cluster", "paper")
    assert scene.discs.density_matching is False
    assert [stage.insitu for stage in scene.stage if stage.kind == "fill"] == [False]


def test_directions_are_averaged_as_axes(study):
    assert study.mean_and_scatter([170.0, 10.0], axial=True) == pytest.approx((0.0, 200.0**0.5))
    assert study.mean_and_scatter([80.0, 90.0, 100.0], axial=True) == pytest.approx((90.0, 10.0))
    assert study.mean_and_scatter([1.0, 3.0]) == pytest.approx((2.0, 2.0**0.5))
    assert study.mean_and_scatter([3.0]) == (3.0, None)


def test_cells_of_the_tables(study):
    def row(*values):
        fabric = dict(zip(study.QUANTITIES, values, strict=True)) | {"a_noise": 0.22, "a_n_noise": 0.1}
        return {"moments": {"d": {"fabric": {"all": fabric, "stone-stone": None}}, "c": None}}

    rows = [row(0.2, 80.0, 0.5, 84.0), row(0.3, 100.0, 0.5, 84.0)]
    assert study.pair(rows, "d", "all", "a", "theta_a") == "0.25 ± 0.07, 90 ± 14° (1 of 2 isotropic)"
    assert study.pair(rows[1:], "d", "all", "a", "theta_a") == "0.30, 100°"
    assert study.pair(rows[:1], "d", "all", "a", "theta_a") == "0.20, isotropic"
    assert study.pair(rows, "d", "stone-stone", "a", "theta_a") == "-"  # too few contacts
    assert study.pair(rows, "c", "all", "a", "theta_a") == "-"  # not reached
    assert study.pair(rows[:1], "d", "all", "a_n", "theta_n") == "0.50, 84°"
