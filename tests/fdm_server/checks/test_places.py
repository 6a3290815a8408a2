"""Boundaries, loads and excavations that act elsewhere than drawn are doubted, with what they reach."""

import re

import pytest

from coupler_protocol.scene.reader import build_scene, read_scene
from fdm_server.checks.places import doubts_of_places
from fdm_server.mesh.grid import build_grid
from tests.small_grounds import REST, TABLES


def said(stages=(), boundary=()):
    scene = build_scene(TABLES | {"stage": [REST, *stages], "boundary": [*TABLES["boundary"], *boundary]})
    return [f"{what}; {remedy}" for _, what, remedy in doubts_of_places(scene, build_grid(scene))]


def dig(name="dig", **table):
    return {"name": name, "kind": "excavate", "excavate": table, "until": {"ratio": 1e-5, "steps": 2000}}


def pit(left, floor, right):
    return [[left, floor], [right, floor], [right, 4.0], [left, 4.0]]


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"x": [0.0, 1.2], "velocity": {"y": -1e-6}}, "from 0 to 1 m: .*begin at 0 and end at 1 or 1.5 m"),
        ({"x": [0.8, 2.0], "fix": "x"}, "from 1 to 2 m: .*begin at 1 or 0.5 and end at 2 m"),
        ({"x": [3.0, 6.0], "pressure": 1e5}, "acts on 1 of 3 m: the side top has no more there; .*between 0 and 4 m"),
        ({"x": [-2.0, 1.0], "stress": {"yy": -1e5}}, "acts on 1 of 3 m"),
    ],
)
def test_a_range_that_the_side_does_not_have_is_doubted(table, words):
    (found,) = said(boundary=[{"on": "top", **table}])
    assert re.search(words, found)


@pytest.mark.parametrize(
    "table",
    [
        {"x": [0.0, 1.0], "velocity": {"y": -1e-6}},
        {"x": [-1.0, 9.0], "fix": "x"},  # all of the side
        {"x": [0.9, 1.2], "fix": "x"},  # one gridpoint
        {"x": [0.3, 1.7], "pressure": 1e5},  # loads end exactly there
    ],
)
def test_a_range_that_ends_where_it_is_drawn_is_not(table):
    assert said(boundary=[{"on": "top", **table}]) == []


def test_excavations_of_another_area_than_drawn_are_doubted():
    assert said([dig(polygon=pit(1.0, 3.0, 3.0))]) == []
    (found,) = said([dig(polygon=pit(1.0, 2.7, 3.0))])
    assert "removes zones of 3 m2, +15 % of the 2.6 m2 drawn" in found
    later = dig("more", polygon=pit(1.0, 1.7, 3.0))  # the ground is 1.3 m lower there, as drawn
    assert [text.partition(",")[0] for text in said([dig(polygon=pit(1.0, 2.7, 3.0)), later])][1:] == []
    assert said([dig(columns=[2, 5], rows=[6, 7]), dig("more", polygon=pit(1.0, 2.5, 3.0))]) == []


def test_columns_and_rows_beyond_the_grid_are_doubted():
    found = said([dig(columns=[3, 40], rows=[6, 70])])
    assert [text.partition(":")[0] for text in found] == ["excavation 'dig' ends at column 40", "excavation 'dig' ends at row 70"]


def test_shipped_scenes_act_where_they_are_drawn(configs):
    for path in sorted(configs.glob("*.toml")):
        scene = read_scene(path)
        if scene.grid is not None:
            assert list(doubts_of_places(scene, build_grid(scene))) == [], path.name
