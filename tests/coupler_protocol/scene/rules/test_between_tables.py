"""What a scene may say about stones, and what it is told where it must not."""

import copy
import tomllib

import pytest

from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import build_scene
from coupler_protocol.scene.rules.between_tables import doubts


@pytest.fixture(scope="module")
def paper(configs):
    return tomllib.loads((configs / "paper_slope.toml").read_text())


def changed(data, *changes):
    """A copy of the scene's tables; each change is (table, key, value), value None: removed."""
    data = copy.deepcopy(data)
    for table, key, value in changes:
        place = data
        for part in table:
            place = place[part]
        if value is None:
            del place[key]
        else:
            place[key] = value
    return data


def test_stones_of_the_paper(paper):
    stones = build_scene(paper).stones
    assert (stones.content, stones.body, stones.gap) == (0.45, "clump", 0.03)
    assert (stones.vertices, stones.flatness) == ((6, 12), (1.0, 1.8))
    assert (stones.size.mean, stones.size.sigma, stones.size.min, stones.size.max) == (0.25, 0.35, 0.12, 0.6)


def test_no_tables_no_stones(paper):
    scene = build_scene(changed(paper, ((), "stones", None), (("discs",), "stone", None)))
    assert scene.stones is None
    assert scene.discs.stone is None


MAPPED = [(("stones",), key, None) for key in ("content", "size", "vertices", "flatness", "gap")]


def mapped_by(paper, file, **keys):
    return changed(paper, *MAPPED, (("stones",), "file", str(file)), *((("stones",), k, v) for k, v in keys.items()))


def test_a_broken_map_is_a_problem_of_the_scene(paper, tmp_path):
    """Missing, crossed and overlapping outlines are found with the scene's other problems, before anything runs."""
    with pytest.raises(SceneError, match=r"stones.file.*no such file"):
        build_scene(mapped_by(paper, tmp_path / "none.csv"))
    (tmp_path / "crossed.csv").write_text("stone,x,y\na,0,0\na,1,1\na,1,0\na,0,1\n", encoding="utf-8")
    with pytest.raises(SceneError, match=r"outline of stone a crosses .* at \(0.5, 0.5\)"):
        build_scene(mapped_by(paper, tmp_path / "crossed.csv"))
    corners = "a,0,0\na,2,0\na,0,2\nb,1,0\nb,2,2\nb,0,1\n"
    (tmp_path / "overlap.csv").write_text("stone,x,y\n" + corners, encoding="utf-8")
    with pytest.raises(SceneError, match="stone a and stone b overlap by"):
        build_scene(mapped_by(paper, tmp_path / "overlap.csv"))


def test_a_map_and_its_small_stones(paper, tmp_path):
    """Stones smaller than a disc are worth a second look; written out and read again the scene is the same."""
    corners = "a,11.1,6\na,12.1,6\na,11.1,7\nb,12.5,6\nb,12.5001,6\nb,12.5,6.0001\n"
    (tmp_path / "map.csv").write_text("stone,x,y\n" + corners, encoding="utf-8")
    scene = build_scene(mapped_by(paper, tmp_path / "map.csv", outside="refuse"))
    assert next(what for path, what, _ in doubts(scene) if path == ("stones", "file")).endswith("stone b")
    assert build_scene(scene.resolved()).digest() == scene.digest()


@pytest.mark.parametrize(
    ("changes", "key", "words"),
    [
        ([(("discs",), "stone", None)], "stones", ["without a material", "[discs.stone]"]),
        ([(("discs", "stone"), "spring", None)], "discs.stone", ["no stiffness", "spring ="]),
        ([(("stones",), "body", "cluster"), (("discs", "stone"), "bond", None)], "discs.stone", ["cluster", "bond ="]),
        ([(("stones", "size"), "min", 0.05)], "stones.size.min", ["smaller than a disc", "0.06"]),
        ([(("stones", "size"), "min", 0.3)], "stones.size", ["increasing"]),
        ([(("stones",), "vertices", [12, 6])], "stones.vertices", ["larger than the second"]),
        ([(("stones",), "content", 0.9)], "stones.content", ["0.75"]),
        ([(("stones",), "body", "clumps")], "stones.body", ["clump"]),
        ([(("stones",), "sizes", 1)], "stones.sizes", ["size"]),
        ([(("stones",), "content", None), (("stones",), "size", None)], "stones.size", ["missing", "file ="]),
        ([(("stones",), "file", "none.geojson")], "stones.content", ["from `file` do not use this key", "remove"]),
        ([(("stones",), "file", "none.csv"), (("stones",), "flatness", [1, 2])], "stones.flatness", ["come from `file`"]),
        ([(("stones",), "shapes", "none.csv")], "stones.shapes", ["no such file"]),
        ([(("stones",), "shapes", "none.csv"), (("stones",), "vertices", [6, 9])], "stones.vertices", ["come from `shapes`"]),
        ([(("stones",), "scale", 0.1)], "stones.scale", ["from `file`"]),
        ([(("stones",), "flip_y", True)], "stones.flip_y", ["no file of outlines"]),
        ([(("stones",), "outside", "cut")], "stones.outside", ["clip", "leave out"]),
        ([(("stones",), "azimuth", {"mean": 30.0})], "stones.azimuth", ["mean and spread, or range"]),
        ([(("stones",), "azimuth", {"mean": 3, "spread": 1, "range": [0, 9]})], "stones.azimuth", ["or range"]),
        ([(("stones",), "azimuth", {"range": [0.0, 190.0]})], "stones.azimuth", ["180 degrees"]),
        ([(("stones",), "azimuth", {"range": [9.0, 0.0]})], "stones.azimuth.range", ["larger than the second"]),
    ],
)
def test_problems_say_what_would_be_right(paper, changes, key, words):
    with pytest.raises(SceneError) as found:
        build_scene(changed(paper, *changes))
    problems = [p for p in found.value.problems if p.key == key]
    assert problems, found.value.problems
    text = f"{problems[0].reason} {problems[0].remedy}"
    assert all(word in text for word in words), text
