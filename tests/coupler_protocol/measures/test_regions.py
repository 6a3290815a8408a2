"""Parts of lines in polygons against shapely, and what a region is."""

import numpy as np
import pytest
import shapely

from coupler_protocol.geometry import share_in_polygon
from coupler_protocol.measures.regions import Region

L_SHAPE = np.array([[0.0, 0.0], [1.0, 0.2], [1.1, 0.7], [0.5, 0.5], [0.4, 1.2], [-0.2, 1.0]])  # five and six crossings, oblique


def test_parts_of_lines_in_an_oblique_polygon_that_is_not_convex():
    rng = np.random.default_rng(1)
    start, branch = rng.uniform(-0.5, 1.5, (2000, 2)), rng.normal(0.0, 0.8, (2000, 2))
    lines = shapely.linestrings(np.stack([start, start + branch], axis=1))
    expected = shapely.length(shapely.intersection(lines, shapely.Polygon(L_SHAPE))) / shapely.length(lines)
    np.testing.assert_allclose(share_in_polygon(start, branch, L_SHAPE), expected, atol=1e-12)
    np.testing.assert_allclose(share_in_polygon(start, branch, L_SHAPE[::-1]), expected, atol=1e-12)
    assert (expected == 0.0).any()
    assert (expected > 0.999).any()


def test_lines_through_corners_and_along_edges_are_counted_once():
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    start = np.array([[-1.0, -1.0], [0.5, -1.0], [0.5, 0.5], [-1.0, 0.5], [2.0, 0.0]])
    branch = np.array([[3.0, 3.0], [0.0, 3.0], [0.2, 0.1], [1.0, 0.0], [-1.0, 1.0]])
    np.testing.assert_allclose(share_in_polygon(start, branch, square), [1.0 / 3.0, 1.0 / 3.0, 1.0, 0.0, 0.0], atol=1e-15)


def test_both_kinds_of_region_have_area_edge_bounds_and_inside():
    circle, square = Region((1.0, 2.0, 0.5)), Region([[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]])  # clockwise
    assert circle.area == pytest.approx(np.pi / 4.0)
    assert circle.perimeter == pytest.approx(np.pi)
    assert (square.area, square.perimeter) == (1.0, 4.0)
    np.testing.assert_array_equal(circle.bounds, [[0.5, 1.5], [1.5, 2.5]])
    np.testing.assert_array_equal(square.bounds, [[0.0, 0.0], [1.0, 1.0]])
    assert circle.contains(np.array([[1.4, 2.0], [1.4, 2.4]])).tolist() == [True, False]
    whole = square.areas(np.array([[0.5, 0.5], [1.0, 0.5], [1.0, 1.0]]), np.full(3, 0.1))
    np.testing.assert_allclose(whole, np.pi * 0.01 * np.array([1.0, 0.5, 0.25]), rtol=1e-12)


@pytest.mark.parametrize("wrong", [(1.0, 2.0, 0.0), (1.0, 2.0), [[0, 0], [1, 1], [1, 0], [0, 1]], [[0, 0], [1, 0]], "circle"])
def test_other_regions_are_refused(wrong):
    with pytest.raises(ValueError, match=r"a region is|could not convert"):
        Region(wrong)
