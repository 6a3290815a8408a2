"""What random outlines of stones must have in common."""

import numpy as np
import pytest
import shapely

from coupler_protocol.geometry import moments
from dem_server.stones.polygons import placed, random_outline


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
