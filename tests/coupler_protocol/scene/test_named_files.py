"""Files that a scene names count from its folder, and their contents belong to the scene."""

import json
import os

import pytest

from coupler_protocol.files import restart
from coupler_protocol.problems import SceneError
from coupler_protocol.scene.differences import first_difference
from coupler_protocol.scene.moments import Moment
from coupler_protocol.scene.named_files import without_paths
from coupler_protocol.scene.reader import build_scene, read_scene
from coupler_protocol.scene.rules.between_tables import doubts
from coupler_protocol.wire.handshake import Choice, _objection
from tests.coupler_protocol.wire.test_handshake import right_hello

DISCS = """
format = 1
seed = 1
discs = { radius = 0.1, file = "sub/row.csv", soil = { density = 2000.0, spring = { normal = 1e7, shear = 1e7 } } }
stage = [{ name = "fill" }, { name = "rest", kind = "discs", until = { steps = 5 } }]
"""
ROW = "x,y,radius\n0,0,0.1\n"
ROCKS = '{"type": "Polygon", "coordinates": [[[0.2, 0.2], [0.6, 0.2], [0.4, 0.6]]]}'


@pytest.fixture
def folder(tmp_path):
    """A scene with its file in a folder below, and the working directory elsewhere."""
    (tmp_path / "scene" / "sub").mkdir(parents=True)
    (tmp_path / "scene" / "scene.toml").write_text(DISCS, encoding="utf-8")
    (tmp_path / "scene" / "sub" / "row.csv").write_text(ROW, encoding="utf-8")
    (tmp_path / "elsewhere").mkdir()
    before = os.getcwd()
    os.chdir(tmp_path / "elsewhere")
    yield tmp_path / "scene"
    os.chdir(before)


def test_paths_count_from_the_folder_of_the_scene(folder):
    scene = read_scene(folder / "scene.toml")
    assert scene.discs.file == str(folder / "sub" / "row.csv")
    assert len(scene.discs.file_hash) == 64
    (folder / "other.csv").write_text(ROW.replace("0,0", "1,1"), encoding="utf-8")
    assert read_scene(folder / "scene.toml", ["discs.file=other.csv"]).discs.file == str(folder / "other.csv")
    assert read_scene(os.path.relpath(folder / "scene.toml")).discs.file == scene.discs.file


def test_what_a_run_leaves_names_the_same_file(folder):
    """scene.json of the run folder, from any working directory; its hash finds a file that has changed since."""
    scene = read_scene(folder / "scene.toml")
    left = folder.parent / "elsewhere" / "scene.json"
    left.write_text(json.dumps(scene.resolved()), encoding="utf-8")
    again = read_scene(left)
    assert again.discs.file == scene.discs.file
    assert again.digest() == scene.digest()
    (folder / "sub" / "row.csv").write_text(ROW.replace("0,0", "0,1e-9"), encoding="utf-8")
    with pytest.raises(SceneError, match=r"row\.csv is not the file that the scene was made with.*\n.*restore the file"):
        read_scene(left)
    read_scene(folder / "scene.toml")  # this one takes any contents


def test_equal_files_in_two_places_are_equal_scenes_and_others_are_not(folder, tmp_path):
    one = read_scene(folder / "scene.toml")
    (tmp_path / "copy" / "sub").mkdir(parents=True)
    for name in ("scene.toml", "sub/row.csv"):
        (tmp_path / "copy" / name).write_bytes((folder / name).read_bytes())
    two = read_scene(tmp_path / "copy" / "scene.toml")
    assert one.discs.file != two.discs.file
    assert one.digest() == two.digest()
    assert _objection(right_hello(two), one, Choice()) is None
    restart.check_scene(two, one.resolved(), 0, "there")
    (tmp_path / "copy" / "sub" / "row.csv").write_text(ROW.replace("0,0", "0,1"), encoding="utf-8")
    three = read_scene(tmp_path / "copy" / "scene.toml")
    assert one.digest() != three.digest()
    assert "the scenes differ: discs.file: 'contents with the hash" in _objection(right_hello(three), one, Choice())
    with pytest.raises(SceneError, match=r"discs\.file: 'contents with the hash .*' on this scene"):
        restart.check_scene(three, one.resolved(), 0, "there")
    assert "one side begins elsewhere" in _objection(right_hello(two), one, Choice([Moment(5, 0, 0)]))


def test_the_same_holds_for_shapes_of_stones(folder, configs):
    (folder / "a.json").write_text(ROCKS, encoding="utf-8")
    (folder / "b.json").write_text(ROCKS.replace("0.6]", "0.7]"), encoding="utf-8")
    data = read_scene(configs / "quick_slope.toml").model_dump(mode="json", exclude_none=True)
    data["discs"] |= {"stone": data["discs"]["soil"]}
    size = {"mean": 0.25, "sigma": 0.35, "min": 0.15, "max": 0.6}
    one, two = (
        without_paths(build_scene(data | {"stones": {"content": 0.3, "size": size, "shapes": name}}, folder=folder).resolved())
        for name in ("a.json", "b.json")
    )
    assert first_difference(one, one) is None
    assert first_difference(one, two).startswith("stones.shapes: 'contents with the hash ")


def test_a_file_that_is_not_there_is_told_with_where_it_was_looked_for(folder, tmp_path):
    (tmp_path / "elsewhere" / "gone.csv").write_text(ROW, encoding="utf-8")
    with pytest.raises(SceneError) as found:
        read_scene(folder / "scene.toml", ["discs.file=gone.csv"])
    assert str(folder / "gone.csv") in str(found.value)
    assert f"paths count from the folder of the scene; there is {tmp_path / 'elsewhere' / 'gone.csv'}" in str(found.value)


def test_what_is_no_path_is_refused(folder):
    with pytest.raises(SceneError, match="not a path"):
        read_scene(folder / "scene.toml", ['discs.file="a\\u0000b"'])
    with pytest.raises(SceneError, match="a hash without file"):
        build_scene({"discs": {"file_hash": "0" * 64}})
    with pytest.raises(SceneError, match=r"discs\.file_hash"):
        read_scene(folder / "scene.toml", ["discs.file_hash=5", "discs.file=gone.csv"])


@pytest.mark.parametrize("key", ["shapes", "file"])
def test_the_machine_of_the_grid_does_not_need_files_of_the_discs(folder, configs, tmp_path, key):
    """Its scene is the same: the hash of the discs' side counts. Where both have the file, the contents are compared."""
    data = read_scene(configs / "quick_slope.toml").model_dump(mode="json", exclude_none=True)
    data["discs"] |= {"stone": data["discs"]["soil"]}
    size = {"mean": 0.25, "sigma": 0.35, "min": 0.15, "max": 0.6}
    more = {"content": 0.3, "size": size} if key == "shapes" else {}
    data |= {"stones": more | {key: "rocks.json"}}
    (folder / "rocks.json").write_text(ROCKS, encoding="utf-8")
    (tmp_path / "grid").mkdir()
    discs = build_scene(data, folder=folder)
    with pytest.raises(SceneError, match="there is no such file"):
        build_scene(data, folder=tmp_path / "grid")
    grid = build_scene(data, folder=tmp_path / "grid", needs_files=False)
    assert _objection(right_hello(discs), grid, Choice()) is None
    assert [row for row in doubts(grid) if row[0][:2] == ("stones", key)] == []
    (tmp_path / "grid" / "rocks.json").write_text(ROCKS.replace("0.6]", "0.7]"), encoding="utf-8")
    other = build_scene(data, folder=tmp_path / "grid", needs_files=False)
    assert f"the scenes differ: stones.{key}: 'contents with the hash" in _objection(right_hello(discs), other, Choice())
    (tmp_path / "grid" / "rocks.json").write_text("nonsense", encoding="utf-8")
    with pytest.raises(SceneError, match="not valid JSON"):
        build_scene(data, folder=tmp_path / "grid", needs_files=False)
