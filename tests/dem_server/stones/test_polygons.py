"""Moments of polygons against closed forms, and what random outlines of stones must have in common."""

import numpy as np
import pytest
import shapely

from dem_server.stones.polygons import moments, placed, random_outline


def test_moments_of_a_turned_rectangle_far_away():
    a, b, turn = 3.0, 2.0, 0.4
    c, s = np.cos(turn), np.sin(turn)
    R = np.array([[c, -s], [s, c]])
    corners = np.array([[0, 0], [a, 0], [a, b], [0, b]]) @ R.T + [1e4, -2e4]
    found = moments(corners)
    assert found.area == pytest.approx(a * b, rel=1e-10)
    np.testing.assert_allclose(found.centroid, R @ [a / 2, b / 2] + [1e4, -2e4], rtol=1e-14)
    expected = R @ np.diag([a**3 * b / 12, a * b**3 / 12]) @ R.T
    np.testing.assert_allclose(found.second, expected, rtol=1e-9)
    assert found.gyration == pytest.approx((a * a + b * b) / 12, rel=1e-9)


def test_moments_of_a_concave_polygon_by_parts():
    corners = np.array([[0, 0], [3, 0], [3, 1], [1, 1], [1, 2], [0, 2]], dtype=float)
    centroid = np.array([(3 * 1.5 + 1 * 0.5) / 4, (3 * 0.5 + 1 * 1.5) / 4])
    xx = 3**3 / 12 + 3 * (1.5 - centroid[0]) ** 2 + 1 / 12 + (0.5 - centroid[0]) ** 2
    found = moments(corners)
    assert found.area == 4.0
    np.testing.assert_allclose(found.centroid, centroid, rtol=1e-14)
    assert found.second[0, 0] == pytest.approx(xx, rel=1e-14)


@pytest.mark.parametrize("flatness", [1.0, 1.4, 2.5])
def test_outlines_are_simple_of_area_one_and_as_flat_as_asked(flatness):
    rng = np.random.default_rng(1)
    convex = 0
    for corners in (4, 6, 9, 12) * 10:
        outline = random_outline(corners, flatness, rng)
        polygon = shapely.Polygon(outline)
        assert outline.shape == (corners, 2)
        assert polygon.is_valid
        assert polygon.exterior.is_ccw
        area, centroid, second = moments(outline)
        assert area == pytest.approx(1.0, rel=1e-14)
        np.testing.assert_allclose(centroid, 0.0, atol=1e-15)
        assert np.sqrt(second[0, 0] / second[1, 1]) == pytest.approx(flatness, rel=1e-12)
        assert abs(second[0, 1]) < 1e-15
        convex += polygon.convex_hull.area < polygon.area * (1 + 1e-12)
    assert 0 < convex < 40  # both kinds


def test_placed_outlines_have_the_area_of_their_circle_and_their_azimuth():
    outline = random_outline(8, 1.5, np.random.default_rng(2))
    area, centroid, second = moments(placed(outline, [2.0, 5.0], 0.7, 0.3))
    assert area == pytest.approx(np.pi * 0.3**2 / 4, rel=1e-14)
    np.testing.assert_allclose(centroid, [2.0, 5.0], rtol=1e-14)
    assert 0.5 * np.arctan2(2 * second[0, 1], second[0, 0] - second[1, 1]) == pytest.approx(0.7, rel=1e-12)
