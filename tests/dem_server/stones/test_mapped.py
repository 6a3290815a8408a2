"""Stones as a file maps them in windows of any shape, and random stones with traced shapes."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
import shapely
from window_case import ANGLE, rim, stones_table

from coupler_protocol.geometry import polygon_area
from coupler_protocol.problems import SceneError
from dem_server.stones.mapped import stones_of
from dem_server.stones.mesostructure import draw

L_SHAPE = 2.0 * ANGLE  # 3 x 3 m without its upper right quarter
CIRCLE = 1.5 * np.column_stack([np.cos(a := 2.0 * np.pi * np.arange(40) / 40), np.sin(a)])
CORNER = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [1.8, 3.0], [0.6, 1.8]])  # of a slope of 45 degrees
KITE = np.array([[0.0, -0.3], [0.8, 0.1], [0.3, 0.3], [0.1, 0.8]])  # concave
ARROW = np.array([[0.0, 0.0], [1.2, 0.25], [0.0, 0.5], [0.3, 0.25]])


def file_of(tmp_path, *polygons):
    rings = [[*p.tolist(), p[0].tolist()] for p in map(np.asarray, polygons)]
    features = [{"type": "Feature", "geometry": {"type": "Polygon", "coordinates": [ring]}} for ring in rings]
    path = tmp_path / "stones.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}), encoding="utf-8")
    return str(path)


def box(x, y, width, height):
    return [[x, y], [x + width, y], [x + width, y + height], [x, y + height]]


def test_stones_lie_where_they_are_mapped(tmp_path):
    file = file_of(tmp_path, 100.0 * KITE, 100.0 * np.add(ARROW, [1.3, 0.4]), box(900, 900, 10, 10))
    found = stones_of(L_SHAPE, stones_table(file=file, scale=0.01, origin=(0.1, 0.4)), None)
    assert found.area == pytest.approx(polygon_area(KITE) + polygon_area(ARROW), rel=1e-12)
    shape = {tuple(p) for p in np.round(found.outlines[0], 9).tolist()}
    assert shape == {tuple(p) for p in np.round(np.add(KITE, [0.1, 0.4]), 9).tolist()}
    assert (np.diff(found.size) <= 0.0).all()
    assert found.sweeps == 0


def test_the_window_cuts_what_reaches_beyond_it(tmp_path):
    """A bar across the foot of an L, and one past its re-entrant corner, of which two pieces of .16 m2 stay."""
    file = file_of(tmp_path, box(-1.0, 0.5, 5.0, 0.5), [[1.0, 2.5], [2.5, 1.0], [2.7, 1.2], [1.2, 2.7]], box(0.2, 1.6, 0.3, 0.2))
    found = stones_of(L_SHAPE, stones_table(file=file), None)
    assert sorted(map(polygon_area, found.outlines)) == pytest.approx([0.06, 0.16, 0.16, 1.5], rel=1e-12)
    assert all(shapely.Polygon(L_SHAPE).buffer(1e-12).covers(shapely.Polygon(outline)) for outline in found.outlines)
    whole = stones_of(L_SHAPE, stones_table(file=file, outside="leave out"), None)
    assert whole.area == pytest.approx(0.06, rel=1e-12)
    with pytest.raises(SceneError, match="2 stones reach beyond the window: feature 1, feature 2"):
        stones_of(L_SHAPE, stones_table(file=file, outside="refuse"), None)


def test_a_window_without_any_stone_is_refused(tmp_path):
    with pytest.raises(SceneError, match=r"no stone of 1 lies in the window.*(?s:.)*check scale, origin"):
        stones_of(L_SHAPE, stones_table(file=file_of(tmp_path, 100.0 * KITE + 1000.0)), None)


@pytest.mark.parametrize("azimuth", [None, (20.0, 60.0)])
@pytest.mark.parametrize("window", [L_SHAPE, CIRCLE, CORNER], ids=["L", "circle", "slope corner"])
def test_traced_shapes_are_drawn_from(tmp_path, window, azimuth):
    """Content exact, gap kept, each stone similar to one of the shapes: its area over that of its convex hull is a shape's."""
    file = file_of(tmp_path, 37.0 * KITE, ARROW + 5.0)
    table = {"content": 0.4, "gap": 0.02, "shapes": file}
    if azimuth:
        table["azimuth"] = SimpleNamespace(mean=None, spread=None, range=azimuth)
    found = draw(rim(window), stones_table(**table), np.random.default_rng(1))
    assert found.area / polygon_area(window) == pytest.approx(0.4, rel=1e-12)
    polygons = [shapely.Polygon(outline) for outline in found.outlines]
    apart = shapely.STRtree(polygons).query(polygons, predicate="dwithin", distance=0.02 * (1.0 - 1e-12))
    assert (apart[0] == apart[1]).all()
    assert shapely.distance(shapely.Polygon(window).exterior, polygons).min() >= 0.02 * (1.0 - 1e-12)
    assert shapely.contains(shapely.Polygon(window), polygons).all()
    fullness = [p.area / p.convex_hull.area for p in polygons]
    shapes = [s.area / s.convex_hull.area for s in (shapely.Polygon(KITE), shapely.Polygon(ARROW))]
    which = np.argmin(np.abs(np.subtract.outer(fullness, shapes)), axis=1)
    np.testing.assert_allclose(fullness, np.array(shapes)[which], rtol=1e-9)
    assert set(which) == {0, 1}
    if azimuth:
        assert (np.degrees(found.azimuth) >= 20.0).all()
        assert (np.degrees(found.azimuth) <= 60.0).all()
