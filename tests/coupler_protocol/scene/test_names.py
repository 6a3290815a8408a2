"""Names that would not be names of files, groups or histories are refused while the scene is read."""

import copy
import tomllib

import pytest

from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import build_scene

ALONE = {
    "format": 1,
    "seed": 1,
    "window": [{"name": "box", "polygon": [[0, 0], [1, 0], [1, 1], [0, 1]]}],
    "discs": {
        "radius": 0.05,
        "soil": {"density": 2000.0, "spring": {"normal": 1e7, "shear": 1e7}},
        "wall": [{"name": "floor", "ends": [[0.0, 0.0], [1.0, 0.0]]}],
    },
    "stage": [{"name": "fill"}, {"name": "rest", "kind": "discs", "until": {"steps": 5}}],
}


@pytest.fixture
def good(configs):
    """The quick scene as plain data, with a named side."""
    data = tomllib.loads((configs / "quick_slope.toml").read_text(encoding="utf-8"))
    data["boundary"][0]["name"] = "left side"
    return data


def refusal(data, key):
    """What is said about one key of a scene."""
    with pytest.raises(SceneError) as found:
        build_scene(data)
    (problem,) = (problem for problem in found.value.problems if problem.key == key)
    return problem.reason


PLACES = ["stage[3].name", "window[0].name", "boundary[0].name"]


def with_name(data, key, name):
    """A copy of the scene with another name at a key such as stage[3].name."""
    data = copy.deepcopy(data)
    table, number = key.removesuffix("].name").split("[")
    place = data[table] if table != "wall" else data["discs"]["wall"]
    place[int(number)] |= (
        {"name": name, "kind": place[int(number)].get("kind", "overload")} if table == "stage" else {"name": name}
    )
    return data


@pytest.mark.parametrize("key", [*PLACES, "wall[0].name"])
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("rest/1g", "no '/'"),
        ("a@b", "no '@'"),
        ("a\\b", r"no '\\\\'"),
        ("a:b", "no ':'"),
        ("two\nlines", "no '\\\\n'"),
        ("nul\0", "no '\\\\x00'"),
        ("a" * 65, "at most 64 bytes in UTF-8, this one has 65"),
        ("ü" * 33, "at most 64 bytes in UTF-8, this one has 66"),
        ("é" * 300, "at most 64 bytes"),
        (".", "a letter or a digit"),
        ("..", "a letter or a digit"),
        (" edge", "does not begin or end with a space"),
        ("", "a letter or a digit"),
    ],
)
def test_a_name_that_could_not_name_a_file_is_refused(good, key, name, words):
    import re

    data = ALONE if key.startswith("wall") else good
    said = refusal(with_name(data, key, name), f"discs.{key}" if key.startswith("wall") else key)
    assert re.search(words, said), said


@pytest.mark.parametrize("key", [*PLACES, "wall[0].name"])
@pytest.mark.parametrize("name", ["ü" * 32, "load 1.5 + -2", "Lastfall_3", "荷载", "a" * 64, "...and more"])
def test_names_of_any_language_are_taken(good, key, name):
    build_scene(with_name(ALONE if key.startswith("wall") else good, key, name))


def test_the_name_of_a_material_is_only_shown(good):
    good["material"][0]["name"] = "clay (soft): c/phi"
    build_scene(good)
    good["material"][0]["name"] = "clay\nsoft"
    assert "visible characters" in refusal(good, "material[0].name")


def test_a_title_cannot_hold_what_files_cannot(good):
    good["title"] = "two\nlines"
    build_scene(good)
    good["title"] = "zero\0"
    assert "zero byte" in refusal(good, "title")


def test_files_of_stages_are_told_apart_on_every_disk(good):
    good["stage"][3] |= {"name": "COUPLE", "kind": "overload"}
    assert refusal(good, "stage[3].name") == "'couple' and 'COUPLE' name the same files on some disks"


def test_a_stage_does_not_take_the_name_of_the_state_that_a_failed_run_leaves(good):
    good["stage"][3] |= {"name": "Stopped", "kind": "overload"}
    assert "State of a run that failed" in refusal(good, "stage[3].name")
