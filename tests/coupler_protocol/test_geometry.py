"""Moments of polygons and lines in circles against closed forms."""

import numpy as np
import pytest

from coupler_protocol.geometry import moments, polygon_area, share_inside, spot


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


def test_share_inside():
    start = np.array([[-2.0, 0.0], [0.0, 0.0], [0.5, 0.0], [-2.0, 0.6], [-2.0, 1.5], [0.1, 0.1]])
    branch = np.array([[4.0, 0.0], [2.0, 0.0], [1.0, 0.0], [4.0, 0.0], [4.0, 0.0], [0.0, 0.2]])
    np.testing.assert_allclose(share_inside(start, branch, 1.0), [0.5, 0.5, 0.5, 0.4, 0.0, 1.0], atol=1e-15)


def test_the_area_of_a_stone_at_utm_coordinates():
    stone = np.array([[0.2, 0.2], [0.7, 0.25], [0.6, 0.7], [0.25, 0.6]])
    there = stone + np.array([412345.0, 5300000.0])
    assert polygon_area(there) == pytest.approx(polygon_area(stone), rel=1e-7)
    assert polygon_area(there[::-1]) == pytest.approx(-polygon_area(stone), rel=1e-7)


@pytest.mark.parametrize(
    ("point", "origin", "text"),
    [
        ((1.23456, 20.0), (0.0, 0.0), "(1.235, 20)"),
        ((1.23456, 20.0), (412345.0, 5300000.0), "(412346.235, 5300020)"),
        ((1.23456, 20.0), (412345.0, 0.0), "(412346.235, 20)"),
        ((0.000123456, -3.0), (-5.5, 420.0), "(-5.4998765, 417)"),
    ],
)
def test_points_of_messages_have_the_digits_of_the_local_place(point, origin, text):
    assert spot(point, origin) == text
