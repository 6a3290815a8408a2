"""scripts/window_felt.py: levels and bisection, what is compared, and the coarse slope with a soft and with a stiffer window."""

import json
from pathlib import Path

import numpy as np
import pytest
from felt import levels, measures, tables
from felt.levels import Course, Hold, Level

from coupler_protocol.scene.reader import read_scene
from tests.commands import run_script


def course_that_fails_at(scene, gravity, hold):
    """The course of a scene that rests below a gravity [g], and the (level, level before) that were computed."""
    seen = []

    def compute(scene, folder, before):
        seen.append((folder.name, before and before.folder.name))
        factor = scene.stage[-1].gravity_factor
        return factor is None or factor.to < gravity

    return levels.course(scene, Path("out"), hold, compute), seen


@pytest.fixture(scope="module")
def begun(configs):
    return levels.begun(read_scene(configs / "paper_slope.toml"), 500)


@pytest.mark.parametrize(("fails", "rests", "moves"), [(4.95, 4.9, 5.0), (2.34, 2.3, 2.4), (1.5, 1.4, 1.5)])
def test_failure_is_found_to_a_tenth_and_each_level_branches_from_rest(begun, fails, rests, moves):
    found, seen = course_that_fails_at(begun, fails, Hold())
    assert (found.rests_at, found.moves_at) == pytest.approx((rests, moves))
    assert seen[0] == ("begin", None)
    resting = {level.folder.name for level in found.resting}
    assert all(before in resting for _, before in seen[1:])
    assert len(seen) == len({name for name, _ in seen})  # nothing twice
    assert len(found.moving) <= 5


def test_a_slope_that_does_not_fail_has_no_first_level_that_moves(begun):
    found, seen = course_that_fails_at(begun, 100.0, Hold(last=3))
    assert [level.gravity for level in found.resting] == [1.0, 2.0, 3.0]
    assert (found.moves_at, len(seen)) == (None, 3)
    with pytest.raises(KeyError):
        found.level(4.0)


def test_levels_are_stages_after_those_up_to_1_g(begun):
    scene = levels.with_level(begun, 2.0, Hold(ramp=70, steps=900))
    assert [stage.name for stage in scene.stage] == ["equilibrium", "fill", "couple", "2 g"]
    last = scene.stage[-1]
    assert (last.gravity_factor.to, last.gravity_factor.over, last.until.steps, last.until.ratio) == (2.0, 70, 900, 1e-5)
    assert last.large_strain
    alone = levels.continuum_alone(begun)
    assert (alone.window, alone.discs, alone.stones) == ([], None, None)
    assert [stage.name for stage in alone.stage] == ["equilibrium"]


def test_the_crest_is_the_highest_gridpoint_at_the_face():
    left = np.array([[0.0, 0.0], [0.0, 4.0], [3.0, 8.0], [5.0, 8.0], [5.0, 0.0]])
    assert measures.crest_of(left).tolist() == [3.0, 8.0]
    assert measures.crest_of(left * [-1.0, 1.0]).tolist() == [-3.0, 8.0]


def test_places_are_found_by_their_coordinates_or_refused():
    xy = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    assert measures.index_of(xy, xy[[2, 0]]).tolist() == [2, 0]
    with pytest.raises(ValueError, match=r"no gridpoint at \(0.5, 0\) m"):
        measures.index_of(xy, np.array([[1.0, 0.0], [0.5, 0.0]]))


def test_differences_count_from_1_g_over_the_continuum_alone(monkeypatch):
    alone, coupled = (Course([Level(g, Path(name), f"{g:g} g", True) for g in (1.0, 3.0)], []) for name in ("alone", "coupled"))
    readings = {  # crest, two gridpoints of the rim, stress, strain
        ("alone", 1.0): ([0.0, 0.0], [[0.0, 0.0], [0.0, 0.0]], [-1e5, -2e5, 0.0], [0.0, 0.0]),
        ("alone", 3.0): ([0.0, -0.02], [[0.0, -0.03], [0.04, 0.0]], [-2e5, -4e5, 1e5], [1e-4, -4e-4]),
        ("coupled", 1.0): ([0.0, -0.001], [[0.0, 0.0], [0.001, 0.0]], [-1e5, -2e5, 0.0], [0.0, 0.0]),
        ("coupled", 3.0): ([0.0, -0.023], [[0.0, -0.03], [0.041, 0.005]], [-1e5, -3e5, 1.4e5], [1e-4, -4e-4]),
    }
    read = {key: measures.Reading(*map(np.array, value)) for key, value in readings.items()}
    monkeypatch.setattr(measures, "read", lambda level, places: read[level.folder.name, level.gravity])
    found = measures.compare(alone, coupled, None, 3.0)
    assert found["crest"] == pytest.approx(0.1)
    assert found["rim"] == pytest.approx(0.1)
    assert [found[key] for key in ("xx", "yy", "xy")] == pytest.approx([-0.5, -0.25, -0.1])
    assert (found["K2"], found["G"]) == pytest.approx((0.5 * 1e5 / 3e-4, 0.5 * 1e5 / 5e-4))


def test_the_mean_strain_is_that_of_the_rim():
    rim = np.array([[0.0, 0.0], [2.0, 1.0], [1.0, 3.0], [-1.0, 2.0]])  # oblique
    assert measures.mean_strain(rim, rim * [2e-3, -3e-3] + [1.0, 2.0]) == pytest.approx([2e-3, -3e-3])
    assert measures.mean_strain(rim, rim[:, ::-1]) == pytest.approx([0.0, 0.0], abs=1e-12)


def test_the_table_has_means_and_scatter():
    keys = "crest", "rim", "xx", "yy", "xy"
    rows = [
        {"seed": 1, "rests_at": 8.1, "moves_at": 8.2, "levels": {"3": dict.fromkeys(keys, 0.02) | {"E": 3.9e8, "nu": 0.3}}},
        {"seed": 2, "rests_at": 8.3, "moves_at": 8.4, "levels": {"3": dict.fromkeys(keys, 0.04) | {"E": 4.1e8, "nu": 0.4}}},
    ]
    alone = {"rests_at": 8.0, "moves_at": 8.1, "E": 4.09e8, "nu": 0.36}
    text = tables.table({"at": 3.0, "alone": alone, "scenes": {"soft": rows}})
    assert "| 0 | 409 | 0.36 | 8.00 | 8.10 | 0 |" in text
    assert "| soft | +3.0 ± 1.4 | 3.0 ± 1.4 |" in text
    assert "| 400 ± 14 | 0.35 ± 0.07 | 8.20 ± 0.14 | 8.30 ± 0.14 | +2.5 ± 1.8 |" in text


@pytest.mark.long
def test_a_stiffer_window_is_felt_less_and_nothing_is_computed_twice(configs, tmp_path):
    pytest.importorskip("matplotlib")
    soft = configs / "quick_slope.toml"
    text = soft.read_text(encoding="utf-8")
    stiff = text.replace("spring = { normal = 5.0e7, shear = 2.0e7 }", "spring = { normal = 8.0e8, shear = 3.2e8 }")
    assert stiff != text
    (tmp_path / "stiff.toml").write_text(stiff, encoding="utf-8")
    words = ["--fast", "--seeds", "1", "--out", tmp_path / "runs", "--json", tmp_path / "felt.json"]
    words = [soft, tmp_path / "stiff.toml", *words, "--picture", tmp_path / "felt.png"]
    done = run_script("window_felt.py", *words)
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "felt.json").read_text(encoding="utf-8"))
    assert (found["alone"]["rests_at"], found["alone"]["moves_at"]) == (3.0, None)
    (own,), (other,) = (found["scenes"][name] for name in ("quick_slope", "stiff"))
    assert set(own["levels"]) == set(other["levels"]) == {"2", "3"}
    a, b = own["levels"]["3"], other["levels"]["3"]
    assert a["crest"] > 0.2  # a plug 25 times too soft
    assert abs(b["crest"]) < 0.5 * a["crest"]
    assert b["rim"] < 0.5 * a["rim"]
    assert a["yy"] < -0.3
    assert a["E"] < 0.1 * found["alone"]["E"] < b["E"]
    assert found["alone"]["E"] == pytest.approx(409.1e6, rel=1e-3)  # of the zones
    assert (tmp_path / "felt.png").stat().st_size > 10_000
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "runs").rglob("run.json")}
    assert len(before) == 9
    again = run_script("window_felt.py", *words)
    assert again.stdout == done.stdout
    assert before == {path: path.stat().st_mtime_ns for path in (tmp_path / "runs").rglob("run.json")}
