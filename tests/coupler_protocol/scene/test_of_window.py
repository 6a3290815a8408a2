"""Discs and stones of a window are those of the scene with the window's own keys; misfits are refused at the window."""

import copy
import json

import pytest

from colluvium.forecast.check import describe
from colluvium.lab.command import chosen
from colluvium.lab.trials import trials_of
from coupler_protocol.problems import SceneError
from coupler_protocol.scene.changes import in_stage
from coupler_protocol.scene.local_origin import local
from coupler_protocol.scene.named_files import paths_of, without_paths
from coupler_protocol.scene.of_window import of_window, of_windows
from coupler_protocol.scene.reader import build_scene, read_scene
from coupler_protocol.scene.rules.between_tables import doubts
from tests.window_scenes import BOX, uniform

ONE = [[1.0, 1.0], [3.0, 1.0], [3.0, 3.0], [1.0, 3.0]]
TWO = [[4.5, 3.5], [6.5, 3.5], [6.5, 5.0], [4.5, 5.0]]
STONE = {"density": 2600.0, "spring": {"normal": 1e8, "shear": 1e8}}
STONES = {"content": 0.2, "size": {"mean": 0.5, "sigma": 0.1, "min": 0.4, "max": 0.6}, "gap": 0.05}
SIZES = {"lognormal": {"mean": 0.1, "sigma": 0.2, "min": 0.08, "max": 0.14}}


def tables(discs=None, stones=None, **more):
    """Tables of a scene of two windows, the second with its own discs and stones."""
    data = uniform(copy.deepcopy(BOX), ONE, radius=0.08)
    own = {key: value for key, value in (("discs", discs), ("stones", stones)) if value is not None}
    data["window"].append({"name": "second", "polygon": TWO} | own)
    return data | more


def own_discs(keys):
    return of_window(build_scene(tables(keys)), 2).discs


def problems(data):
    with pytest.raises(SceneError) as found:
        build_scene(data)
    return {problem.key: problem.reason for problem in found.value.problems}


def test_a_window_without_own_tables_has_those_of_the_scene():
    scene = build_scene(tables())
    assert of_window(scene, 1) is of_window(scene, 2) is local(scene)


def test_given_keys_replace_those_of_the_scene_and_all_others_stay():
    first, second = (own.discs for _, own in of_windows(build_scene(tables({"radius": 0.06, "soil": {"density": 1900.0}}))))
    assert (first.radius, second.radius) == (0.08, 0.06)
    assert (first.soil.density, second.soil.density) == (2000.0, 1900.0)
    assert second.model_copy(update={"radius": 0.08, "soil": first.soil}) == first
    assert second.soil.model_copy(update={"density": 2000.0}) == first.soil


def test_effects_change_by_their_keys_begin_and_are_left_out():
    soil = own_discs(
        {"soil": {"bond": False, "friction": {"coefficient": 0.3}, "spring": {"normal": 4e7}}, "damping": False}
    ).soil
    assert (soil.bond, soil.friction.coefficient, soil.spring.normal, soil.spring.shear) == (None, 0.3, 4e7, 2e7)
    found = own_discs({"damping": False, "stone": STONE})
    assert (found.damping, found.stone.density) == (None, 2600.0)


def test_sizes_replace_each_other():
    graded = own_discs({"grading": SIZES})
    assert graded.radius == pytest.approx(graded.grading.mean_radius)
    data = tables({"spread": 0.1})
    data["discs"] |= {"grading": SIZES}
    assert of_window(build_scene(data), 2).discs.grading is None
    assert of_window(build_scene(data), 1).discs.grading is not None


def test_pairs_of_materials_change_by_their_names():
    data = tables({"pair": [{"between": ["ring", "soil"], "friction": {"coefficient": 0.1}}]})
    data["discs"]["pair"] = [
        {"between": ["soil", "ring"], "friction": {"coefficient": 0.2}, "spring": {"normal": 1e7, "shear": 1e7}}
    ]
    (pair,) = of_window(build_scene(data), 2).discs.pair
    assert (pair.friction.coefficient, pair.spring.normal) == (0.1, 1e7)


def test_stones_of_one_window_only():
    scene = build_scene(tables({"stone": STONE}, STONES))
    assert of_window(scene, 1).stones is None
    assert of_window(scene, 2).stones.content == 0.2
    assert not [path for path, *_ in doubts(scene) if "stone" in path]
    idle = build_scene(tables({"stone": STONE}))
    assert [path for path, *_ in doubts(idle) if "stone" in path] == [("window", 1, "discs", "stone")]


def test_a_change_of_a_stage_acts_on_the_discs_of_every_window():
    data = tables({"radius": 0.06, "soil": {"friction": {"coefficient": 0.3}}})
    data["stage"][2]["discs"] = {"soil": {"bond": {"tension": 1e3}}}
    scene = build_scene(data)
    soils = [in_stage(own, 2).discs.soil for _, own in of_windows(scene)]
    assert [soil.bond.tension for soil in soils] == [1e3, 1e3]
    assert [soil.friction.coefficient for soil in soils] == [0.55, 0.3]
    assert in_stage(of_window(scene, 2), 2).discs.radius == 0.06


def test_an_effect_may_end_that_acts_in_one_window():
    data = tables({"soil": {"bond": False}})
    data["stage"][2]["discs"] = {"soil": {"bond": False}}
    build_scene(data)
    del data["discs"]["soil"]["bond"], data["window"][1]["discs"]
    assert problems(data) == {"stage[2].discs.soil.bond": "there is no bond that could end"}


def test_the_scene_is_one_for_all_processes_and_can_be_read_again(tmp_path):
    scene = build_scene(tables({"radius": 0.06, "soil": {"bond": False}, "stone": STONE}, STONES))
    assert of_window(scene, 2).digest() == scene.digest() != build_scene(tables({"radius": 0.06})).digest()
    (tmp_path / "scene.json").write_text(json.dumps(scene.resolved()), encoding="utf-8")
    again = read_scene(tmp_path / "scene.json", ["window.second.discs.radius=0.05"])
    assert again.window[1].discs.radius == 0.05
    assert of_window(read_scene(tmp_path / "scene.json"), 2).discs == of_window(scene, 2).discs


def test_places_count_from_the_local_origin_once():
    data = tables({"radius": 0.06})
    data["grid"] |= {"origin": [1000.0, 500.0]}
    for window in data["window"]:
        window["polygon"] = [[x + 1000.0, y + 500.0] for x, y in window["polygon"]]
    scene = build_scene(data)
    own = of_window(scene, 2)
    assert own.window[1].polygon[0] == (4.5, 3.5)
    assert of_window(own, 2).window[1].polygon == own.window[1].polygon
    assert own.resolved() == scene.resolved()


@pytest.mark.parametrize(
    ("discs", "stones", "key", "words"),
    [
        ({}, None, "window[1].discs", "changes nothing"),
        ({"soil": {"bond": {}}}, None, "window[1].discs.soil.bond", "changes nothing"),
        ({"soil": {"rolling": False}}, None, "window[1].discs.soil.rolling", "no rolling here that could be left out"),
        ({"soil": {"rolling": {"coefficient": -1.0}}}, None, "window[1].discs.soil.rolling.coefficient", "greater than or equal"),
        ({"stone": {"spring": {"normal": 1e8, "shear": 1e8}}}, None, "window[1].discs.stone.density", "missing"),
        ({"stone": {"density": 2600.0}}, STONES, "window[1].discs.stone", "the stones have no stiffness"),
        ({"radius": 0.5}, None, "window[1]", "too small for discs of radius 0.5 m"),
        ({"raduis": 0.05}, None, "window[1].discs.raduis", "unknown key"),
        ({"wall": []}, None, "window[1].discs.wall", "unknown key"),
        ({"soil": {"spring": False}}, None, "window[1].discs.soil", "no stiffness"),
        (None, STONES, "window[1].stones", "stones without a material"),
        ({"pair": [{"between": ["soil", "soil"]}]}, None, "window[1].discs.pair", "sets nothing"),
        ({"radius": 0.3, "stone": STONE}, STONES, "window[1].stones.size.min", "smaller than a disc"),
    ],
)
def test_what_does_not_fit_is_refused_at_the_window(discs, stones, key, words):
    found = problems(tables(discs, stones))
    assert words in found.get(key, f"{key} not in {found}")


def test_problems_of_all_windows_and_of_the_scene_are_told_at_once():
    data = tables({"soil": {"rolling": False}})
    data["window"].append(
        {"name": "third", "polygon": [[4.5, 1.0], [6.5, 1.0], [6.5, 2.5], [4.5, 2.5]], "discs": {"stone": {"density": 1.0}}}
    )
    data["stones"] = STONES
    data["damping"] = {"local": 0.8}
    data["stage"][2]["discs"] = {"soil": {"rolling": False}}
    assert set(problems(data)) == {
        "window[1].discs.soil.rolling",
        "stones",
        "stage[2].discs.soil.rolling",
        "window[2].discs.stone",
    }


def test_discs_alone_give_their_discs_once():
    alone = {
        "format": 1,
        "seed": 1,
        "discs": tables()["discs"],
        "window": [{"name": "a", "polygon": ONE, "discs": {"radius": 0.05}}],
    }
    alone["stage"] = [{"name": "fill"}, {"name": "rest", "kind": "discs", "until": {"steps": 5}}]
    assert problems(alone) == {"window[0].discs": "discs alone fill one window"}


def test_each_window_may_have_its_own_file(tmp_path):
    """A file counts from the folder of the scene, belongs to it by its contents, and fills one window."""
    for name in ("a.csv", "b.csv"):
        (tmp_path / name).write_text("x,y,radius\n5.0,4.0,0.08\n", encoding="utf-8")
    scene = build_scene(tables({"file": "a.csv"}), folder=tmp_path)
    assert of_window(scene, 2).discs.file == str(tmp_path / "a.csv")
    assert list(paths_of(scene)) == [("window", 1, "discs", "file")]
    assert without_paths(scene.resolved())["window"][1]["discs"]["file"].startswith("contents with the hash ")
    assert of_window(scene, 1).discs.file is None
    data = tables({"file": "a.csv"})
    data["window"][0]["discs"] = {"file": "a.csv"}
    with pytest.raises(SceneError, match="one file cannot fill 2 windows"):
        build_scene(data, folder=tmp_path)
    data["window"][0]["discs"] = {"file": "b.csv"}
    assert len(paths_of(build_scene(data, folder=tmp_path))) == 2
    with pytest.raises(SceneError, match=r"window\[1\]\.discs\.file: there is no file"):
        build_scene(tables({"file": "c.csv"}), folder=tmp_path)


def test_check_describes_the_discs_of_every_window():
    found = describe(build_scene(tables({"radius": 0.05, "stone": STONE | {"rolling": {"coefficient": 0.1}}}, STONES)))
    first, second = found["windows"]
    assert "radius" not in first
    assert (second["radius"], second["stones"]["content"]) == (0.05, 0.2)
    assert second["discs"] / second["area"] == pytest.approx((0.08 / 0.05) ** 2 * first["discs"] / first["area"], rel=0.01)
    (rolling,) = (row for row in found["effects"] if row["effect"] == "grain.rolling")
    assert rolling["where"] == ["window 'second' discs.stone"]


def test_the_laboratory_takes_the_discs_of_the_window_that_is_named():
    scene = build_scene(tables({"radius": 0.05, "stone": STONE}, STONES))
    for name in ("second", "2"):
        found = trials_of("biaxial", chosen(scene, name, "scene.toml"))
        assert {trial.sample for trial in found} == {"soil", "clump"}
        assert {trial.tables["discs"]["radius"] for trial in found} == {0.05}
    assert {trial.tables["discs"]["radius"] for trial in trials_of("biaxial", chosen(scene, None, ""))} == {0.08}
    with pytest.raises(SceneError, match=r"no window '3'\n.*windows: hole, second"):
        chosen(scene, "3", "scene.toml")


def test_a_region_is_as_wide_as_the_discs_of_its_window_ask():
    region = {"name": "core", "window": "second", "centre": [5.5, 4.25], "radius": 0.25}
    build_scene(tables({"radius": 0.06}, measure=[region]))
    found = problems(tables(measure=[region]))
    assert found == {"measure[0].radius": "a circle of 0.5 m across is smaller than 4 discs"}
