"""What a scene may say about stones, and what it is told where it must not."""

import copy
import tomllib

import pytest

from coupler_protocol.problems import SceneError
from coupler_protocol.scene_reader import build_scene


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


@pytest.mark.parametrize(
    ("changes", "key", "words"),
    [
        ([(("discs",), "stone", None)], "stones", ["without a material", "[discs.stone]"]),
        ([((), "stones", None)], "discs.stone", ["no stones", "[stones]"]),
        ([(("discs", "stone"), "spring", None)], "discs.stone", ["no stiffness", "spring ="]),
        ([(("stones",), "body", "cluster"), (("discs", "stone"), "bond", None)], "discs.stone", ["cluster", "bond ="]),
        ([(("stones", "size"), "min", 0.05)], "stones.size.min", ["smaller than a disc", "0.06"]),
        ([(("stones", "size"), "min", 0.3)], "stones.size", ["increasing"]),
        ([(("stones",), "vertices", [12, 6])], "stones.vertices", ["larger than the second"]),
        ([(("stones",), "content", 0.9)], "stones.content", ["0.75"]),
        ([(("stones",), "body", "clumps")], "stones.body", ["clump"]),
        ([(("stones",), "sizes", 1)], "stones.sizes", ["size"]),
    ],
)
def test_problems_say_what_would_be_right(paper, changes, key, words):
    with pytest.raises(SceneError) as found:
        build_scene(changed(paper, *changes))
    problems = [p for p in found.value.problems if p.key == key]
    assert problems, found.value.problems
    text = f"{problems[0].reason} {problems[0].remedy}"
    assert all(word in text for word in words), text
