"""The rim of a polygon without a grid: nodes about as far apart as asked, on its sides, and near a curve of short sides."""

import numpy as np
import pytest
import shapely
from verification.discrete import scenes

from coupler_protocol.interface.ring import build_ring
from coupler_protocol.problems import SceneError
from dem_server.packing.alone_window import rim_of

RADIUS = 0.05


def lengths(nodes):
    return np.hypot(*(np.roll(nodes, -1, axis=0) - nodes).T)


def test_nodes_lie_on_the_sides_of_an_oblique_polygon():
    corners = [[0.0, 0.0], [-0.3, 1.1], [0.9, 1.5], [1.2, 0.4]]  # clockwise
    nodes = rim_of(corners, 4.0 * RADIUS)
    assert shapely.distance(shapely.Polygon(corners).exterior, shapely.points(nodes)).max() < 1e-15
    assert shapely.Polygon(nodes).area == pytest.approx(shapely.Polygon(corners).area, rel=1e-14)
    assert shapely.Polygon(nodes).exterior.is_ccw
    assert lengths(nodes) == pytest.approx(4.0 * RADIUS, rel=0.15)


def test_a_circle_of_many_corners_gets_control_discs_of_the_size_asked_for():
    angle = np.arange(200) * 2.0 * np.pi / 200
    circle = 1.5 * np.column_stack([np.cos(angle), np.sin(angle)])
    nodes = rim_of(circle, 4.0 * RADIUS)
    assert shapely.Polygon(nodes).area == pytest.approx(2.25 * np.pi, rel=0.01)
    assert build_ring(nodes, RADIUS).radius == pytest.approx(RADIUS, rel=0.35)


def test_a_polygon_that_crosses_itself_is_refused():
    with pytest.raises(SceneError, match="crosses or touches itself"):
        rim_of([[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]], 0.2)


def test_a_material_of_stones_without_stones_changes_nothing():
    square = [{"name": "box", "polygon": [[0.0, 0.0], [0.8, 0.0], [0.8, 0.8], [0.0, 0.8]]}]
    found = []
    for more in ({}, {"stone": scenes.SOIL | {"spring": {"normal": 5e8, "shear": 5e8}}}):
        scene = scenes.tables([{"name": "go", "kind": "discs", "until": {"steps": 50}}], more, window=square)
        _, state, stones, _ = scenes.computed(scene)
        assert stones is None
        found.append(state.disc.tobytes() + state.shear.tobytes())
    assert found[0] == found[1]
