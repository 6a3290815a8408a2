"""How long a coupled step may be, as `check` says it before a run, each side during it, and both States after it."""

import json

import pytest

from colluvium import cli, closing
from colluvium.api import Scene
from colluvium.forecast import step_limits

COUPLED = ["couple", "overload"]


@pytest.fixture(scope="module")
def info(quick_run):
    return json.loads((quick_run[0] / "run.json").read_text())


def test_a_run_says_which_zone_node_and_disc_set_the_safe_limits(info):
    rows = {row["name"]: row.get("limits") for row in info["stages"]}
    assert [name for name, found in rows.items() if found] == COUPLED
    discs = {row["stage"]: row for row in info["windows"][0]["limits"]}
    assert list(discs) == COUPLED
    for name in COUPLED:
        assert [rows[name][key]["what"] for key in ("grid", "interface")] == ["zone", "node"]
        assert discs[name]["what"].startswith("disc ")
        assert all(1.0 < found["share"] < 2.0 for found in (*rows[name].values(), discs[name]))
    said = list(closing.step_limits(info))
    assert len(said) == 2
    assert said[0].startswith("stage couple, step limits as multiples of the step in use; safe: grid 1.")
    assert "exact" not in said[0]


def test_the_exact_limit_comes_from_the_states_of_both_processes(info, quick_run):
    found = step_limits.exact_of_run(Scene.read(quick_run[0] / "scene.json"), quick_run[0])
    assert list(found) == COUPLED
    discs = info["windows"][0]["limits"][0]["share"]
    assert discs < found["couple"]["share"] < 2.0 * discs
    rows = [{"name": name, "limits": {"exact": found[name]}} for name in COUPLED]
    assert f"exact: {found['couple']['share']:.2f} (set by" in next(closing.step_limits({"stages": rows}))


def test_check_says_the_limits_before_anything_is_computed(configs, tmp_path):
    out = tmp_path / "check.json"
    assert cli.main(["check", str(configs / "quick_slope.toml"), "--exact", "--no-locate", "--json", str(out)]) == 0
    found = json.loads(out.read_text())["limits"]
    safe = min(found[name]["share"] for name in ("grid", "interface", "discs"))
    assert 1.0 < safe < found["exact"]["share"] < 2.0 * safe
    assert len(list(step_limits.sentences(found))) == 2
    assert cli.main(["check", str(configs / "quick_slope.toml"), "--no-limits", "--no-locate", "--json", str(out)]) == 0
    assert "limits" not in json.loads(out.read_text())


def test_scenes_that_couple_nothing_have_no_such_limits(configs):
    assert not step_limits.couples_discs(Scene.read(configs / "quick_pile.toml"))
    assert not step_limits.couples_discs(Scene.read(configs / "hole.toml"))
