"""A scene that is JSON, begins with a byte order mark, or is broken is read, or refused in words, as any other."""

import codecs
import json
import tomllib

import numpy as np
import pytest

from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import build_scene, read_scene


@pytest.fixture
def resolved(configs, tmp_path):
    """The quick scene as a run leaves it."""
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(read_scene(configs / "quick_slope.toml").resolved()), encoding="utf-8")
    return path


def test_values_of_the_command_line_replace_those_of_a_json_file(resolved, configs):
    overrides = ["seed=7", "stage.couple.handover=7", "damping.local=0.5", "stage.0.damping.local=0.3"]
    scene = read_scene(resolved, overrides)
    assert (scene.seed, scene.stage[2].handover, scene.damping.local) == (7, 7, 0.5)
    assert scene.stage[0].damping.local == 0.3  # null in the file
    assert scene.digest() == read_scene(configs / "quick_slope.toml", overrides).digest()
    with pytest.raises(SceneError, match=r"--set: stage\[2\]\.handover"):
        read_scene(resolved, ["stage.couple.handover=0"])
    with pytest.raises(SceneError, match="not of the form KEY=VALUE"):
        read_scene(resolved, ["seed"])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('{\n "seed": 1,\n "grid": }', r"scene\.json:3: not valid JSON: Expecting value"),
        ("", r"scene\.json:1: not valid JSON"),
        ("[1, 2]", "not a scene, but a list"),
        ("null", "not a scene, but a NoneType"),
        ("[" * 100_000, "nested too deeply"),
        ('{"format": 1, "seed": NaN}', r"scene\.json: seed"),
        ('{"grid": null, "stage": null}', r"scene\.json: stage"),
    ],
)
def test_a_broken_json_file_is_a_problem_of_the_scene(tmp_path, text, words):
    path = tmp_path / "scene.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(SceneError, match=words):
        read_scene(path)


def test_tables_nested_too_deeply_in_toml_are_too(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(f"a = {'[' * 100_000}", encoding="utf-8")
    with pytest.raises(SceneError, match="nested too deeply"):
        read_scene(path)


@pytest.mark.parametrize("ending", ["toml", "json"])
def test_a_byte_order_mark_is_no_part_of_the_text(configs, resolved, tmp_path, ending):
    source = resolved if ending == "json" else configs / "quick_slope.toml"
    path = tmp_path / f"marked.{ending}"
    path.write_bytes(codecs.BOM_UTF8 + source.read_bytes())
    assert read_scene(path).digest() == read_scene(source).digest()


def test_a_key_given_twice_in_json_is_refused_as_in_toml(tmp_path):
    path = tmp_path / "scene.json"
    path.write_text('{"format": 1, "seed": 1, "record": {"every": 5, "every": 6}}', encoding="utf-8")
    with pytest.raises(SceneError, match="the key 'every' is there twice"):
        read_scene(path)


@pytest.mark.parametrize(("name", "text"), [("a.json", '{"seed": %s}'), ("a.toml", "seed = %s")])
def test_an_integer_of_thousands_of_digits_is_a_problem_of_the_scene(tmp_path, name, text):
    path = tmp_path / name
    path.write_text(text % ("9" * 5000), encoding="utf-8")
    with pytest.raises(SceneError, match="integer"):
        read_scene(path)


def test_json_is_known_by_its_ending_in_capitals_also(resolved, tmp_path):
    path = tmp_path / "SCENE.JSON"
    path.write_bytes(resolved.read_bytes())
    assert read_scene(path).digest() == read_scene(resolved).digest()


@pytest.mark.parametrize("encoding", ["utf-16", "utf-32"])
def test_a_text_in_another_encoding_names_it(configs, tmp_path, encoding):
    path = tmp_path / "scene.toml"
    path.write_text((configs / "quick_slope.toml").read_text(encoding="utf-8"), encoding=encoding)
    with pytest.raises(SceneError, match=rf"{encoding.upper()}(.|\n)*save it as UTF-8"):
        read_scene(path)


def test_a_title_that_no_file_can_hold_is_refused(resolved):
    data = json.loads(resolved.read_text(encoding="utf-8")) | {"title": "\ud800"}
    with pytest.raises(SceneError, match=r"title: (.|\n)*half of a character"):
        build_scene(data)


def test_numbers_of_numpy_are_numbers(configs):
    data = tomllib.loads((configs / "quick_slope.toml").read_text(encoding="utf-8"))
    plain = build_scene(data)
    data["grid"]["zone_size"] = np.float64(data["grid"]["zone_size"])
    data["record"] = {"every": np.int64(200)}
    data["stage"][-1]["gravity_factor"]["to"] = np.float32(3.0)
    assert build_scene(data).grid.zone_size == plain.grid.zone_size
    data["grid"]["zone_size"] = np.float32(0.5)
    assert build_scene(data).grid.zone_size == (0.5, 0.5)
