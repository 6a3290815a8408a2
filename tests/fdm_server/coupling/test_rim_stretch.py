"""Zones on a window's rim that are stretched too far are named: how far, which, where, and once a stage."""

from types import SimpleNamespace

import numpy as np
import pytest
from grid_cases import slope

from fdm_server.coupling.rim_stretch import FAR, StretchWatch, stretches
from fdm_server.mesh.grid import build_grid


def turned(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


@pytest.fixture(scope="module")
def grid():
    """A slope of quadrilaterals, with triangles along its face."""
    return build_grid(slope(1.0, [(0, 4), (4, 4), (12, 12), (20, 12)]))


def watch_of(grid, nodes):
    return StretchWatch(SimpleNamespace(grid=grid, zones=grid.zones, zone=np.arange(len(grid.zones))), nodes)


@pytest.mark.parametrize("angle", [0.0, 0.4, 2.0])
def test_stretch_of_a_uniform_strain_is_its_largest_principal_one(grid, angle):
    """Stretched 5 and .2 times along oblique axes and turned by 1 rad, triangles as well."""
    F = turned(1.0) @ turned(angle) @ np.diag([5.0, 0.2]) @ turned(-angle)
    found = stretches(grid.xy, grid.xy @ F.T, grid.zones)
    assert grid.triangular.any()
    np.testing.assert_allclose(found, 5.0, rtol=1e-12)


def test_a_turn_is_no_stretch(grid):
    np.testing.assert_allclose(stretches(grid.xy, grid.xy @ turned(2.5).T, grid.zones), 1.0, rtol=1e-13)


def test_the_farthest_zone_of_the_rim_is_named_once(grid):
    zone = 50
    corners = grid.zones[zone]
    watch, displacement = watch_of(grid, corners[:1]), np.zeros_like(grid.xy)
    assert watch.check(displacement) == ""
    away = turned(0.7)[0]
    displacement[corners[2]] = (FAR - 1.0) * 1.0 * away
    assert watch.check(0.3 * displacement) == ""
    assert watch.report() == {}
    displacement *= 3.0
    said = watch.check(displacement)
    x, y = (grid.xy + displacement)[corners].mean(axis=0)
    assert f"zone {zone} at ({x:.4g}, {y:.4g}) is stretched" in said
    assert watch.check(displacement) == ""
    found = watch.report()["rim_stretched"]
    assert found == {"zone": zone, "stretch": watch.worst.stretch, "place": pytest.approx([x, y])}
    assert watch.worst.stretch > FAR


def test_zones_away_from_the_rim_are_not_watched(grid):
    displacement = np.zeros_like(grid.xy)
    displacement[grid.zones[100]] = np.arange(8.0).reshape(4, 2) * 10.0
    nodes = np.setdiff1d(grid.zones[50], grid.zones[100])
    assert watch_of(grid, nodes).check(displacement) == ""
