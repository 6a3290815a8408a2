"""Walls that almost meet are doubted: a disc at the gap would bounce with e = 0.469 instead of 0.572."""

import numpy as np
import pytest

from coupler_protocol.scene.reader import build_scene, read_scene
from coupler_protocol.scene.rules import walls as rules
from dem_server.step import wall_surface


def said(*ends, **more):
    walls = [{"ends": pair} | {key: values[k] for key, values in more.items()} for k, pair in enumerate(ends)]
    soil = {"density": 2000.0, "spring": {"normal": 1e7, "shear": 5e6}}
    window = {"name": "w", "polygon": [[-1.0, 0.0], [1.0, 0.0], [1.0, 1.0], [-1.0, 1.0]]}
    stages = [{"name": "fill"}, {"name": "rest", "kind": "discs", "gravity": 9.81, "until": {"ratio": 1e-4, "steps": 100}}]
    discs = {"radius": 0.1, "spread": 0.0, "soil": soil, "wall": walls}
    scene = build_scene({"format": 1, "seed": 1, "window": [window], "discs": discs, "stage": stages})
    return [f"{what}; {remedy}" for _, what, remedy in rules.walls_that_almost_meet(scene)]


def line(x0, x1, y=0.0):
    return [[x0, y], [x1, y]]


@pytest.mark.parametrize(
    "ends",
    [
        [line(-2, -1e-5), line(1e-5, 2)],
        [line(-2, 0), line(0, 2, -1e-6)],  # a step
        [line(-2, 2), line(-2, 2, -1e-6)],  # drawn twice
        [line(-2, 2), [[0.5, 1e-4], [0.5, 2.0]]],  # a wall that does not reach the floor
        [line(5e5 - 2, 5e5 - 1e-5), line(5e5 + 1e-5, 5e5 + 2)],  # far from the origin
    ],
)
def test_walls_that_almost_meet_are_doubted(ends):
    (found,) = said(*ends)
    assert found.startswith("walls '1' and '2' almost meet, at a distance of ")


@pytest.mark.parametrize(
    "ends",
    [
        [line(-2, 0), line(0, 2)],
        [line(-2, 2), line(-2, 2)],
        [line(-2, -1e-3), line(-1e-3, 1e-3), line(1e-3, 2)],  # a short piece between
        [line(-2, -0.02), line(0.02, 2)],  # a slot
        [line(-2, 2), [[0.0, -1.0], [0.0, 1.0]]],
    ],
)
def test_walls_that_meet_or_leave_a_gap_are_not(ends):
    assert said(*ends) == []


def test_a_ring_of_short_pieces_is_closed():
    turn = np.linspace(0.0, 2.0 * np.pi, 721)
    points = np.column_stack([np.cos(turn), np.sin(turn)]).round(12).tolist()
    assert said(*([a, b] for a, b in zip(points[:-1], [*points[1:-1], points[0]], strict=True))) == []


def test_walls_that_move_by_themselves_may_leave_a_gap():
    ends = [line(-2, -1e-5), line(1e-5, 2)]
    assert said(*ends, velocity=[[0.0, 0.0], [0.0, 1e-6]]) == []
    assert len(said(*ends, velocity=[[0.0, 1e-6], [0.0, 1e-6]])) == 1


def test_the_tolerance_is_that_of_the_contacts(configs):
    assert rules.SAME == wall_surface.SAME
    for name in ("quick_pile", "quick_biaxial"):
        assert list(rules.walls_that_almost_meet(read_scene(configs / f"{name}.toml"))) == []
