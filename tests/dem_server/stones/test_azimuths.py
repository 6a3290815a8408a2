"""Directions of stones: what was drawn is what lies in the window, also where stones had to jostle for room."""

from types import SimpleNamespace

import numpy as np
import pytest
import scipy.stats
import shapely
from window_case import stones_table

from coupler_protocol.geometry import moments, polygon_area
from dem_server.stones.mesostructure import draw

DOMAIN = np.array([[0.0, 0.0], [9.0, 0.0], [10.0, 5.0], [3.0, 7.0], [0.0, 4.0]])


def azimuth(mean=None, spread=None, range=None):
    return SimpleNamespace(mean=mean, spread=spread, range=range)


def axes(found):
    """Directions of the long axes of the polygons themselves [rad]."""
    return np.array([moments(outline).azimuth for outline in found.outlines])


@pytest.mark.parametrize("content", [0.2, 0.55], ids=["placed", "grown"])
@pytest.mark.parametrize(("mean", "spread"), [(30.0, 15.0), (-80.0, 40.0)])
def test_resultant_of_a_wrapped_normal_distribution(mean, spread, content):
    """<exp(2 i theta)> = exp(2 i mean - 2 spread^2); the mean of N stones scatters by less than 1/sqrt(2 N) along each axis."""
    table = stones_table(content=content, gap=0.02, flatness=(1.3, 1.8), azimuth=azimuth(mean, spread))
    found = draw(DOMAIN, table, np.random.default_rng(2))
    assert (found.sweeps > 0) == (content > 0.5)
    resultant = np.exp(2j * axes(found)).mean()
    expected = np.exp(2j * np.radians(mean) - 2.0 * np.radians(spread) ** 2)
    assert len(found.size) > 100
    assert abs(resultant - expected) < 3.0 / np.sqrt(2.0 * len(found.size))
    assert found.area / polygon_area(DOMAIN) == pytest.approx(content, rel=1e-12)
    polygons = [shapely.Polygon(outline) for outline in found.outlines]
    near = shapely.STRtree(polygons).query(polygons, predicate="dwithin", distance=0.02 * (1.0 - 1e-12))
    assert (near[0] == near[1]).all()


def test_a_range_is_uniform_between_its_ends():
    """From 160 to 200 degrees: through the x-axis. |<exp(2 i theta)>| = sin(w)/w for a width w."""
    table = stones_table(content=0.5, gap=0.0, flatness=(1.3, 1.8), azimuth=azimuth(range=(160.0, 200.0)))
    found = draw(DOMAIN, table, np.random.default_rng(3))
    angle = np.degrees(axes(found))  # -90 to 90
    assert np.abs(angle).max() <= 20.0 + 1e-6
    assert scipy.stats.kstest((angle + 20.0) / 40.0, "uniform").pvalue > 0.01
    width = np.radians(40.0)
    assert abs(np.exp(2j * np.radians(angle)).mean()) == pytest.approx(np.sin(width) / width, abs=0.03)


def test_no_spread_is_one_direction():
    found = draw(DOMAIN, stones_table(content=0.3, flatness=(1.3, 1.8), azimuth=azimuth(100.0, 0.0)), np.random.default_rng(0))
    np.testing.assert_allclose(np.degrees(axes(found)) % 180.0, 100.0, atol=1e-6)
