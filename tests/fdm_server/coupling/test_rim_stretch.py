"""Zones on a window's rim that are stretched too far are named: how far, which, where, and once a stage."""

from types import SimpleNamespace

import numpy as np
import pytest
from grid_cases import slope

from fdm_server.coupling.rim_stretch import FAR, NOW, StretchWatch, largest_stretch, watch_stretch
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


def stretches(grid, F):
    """Stretches of all zones under the uniform strain F."""
    whole, found = watch_of(grid, np.arange(len(grid.xy))).stretch, []
    for z in range(len(grid.zones)):
        zone = whole._replace(zones=whole.zones[z : z + 1], inverse=whole.inverse[z : z + 1])
        watch_stretch(grid.xy @ F.T - grid.xy, zone)
        found.append(zone.found[NOW])
    return found


def test_the_largest_stretch_is_the_largest_singular_value():
    for F in np.random.default_rng(3).normal(size=(50, 2, 2)):
        assert largest_stretch(*F.ravel()) == pytest.approx(np.linalg.svd(F, compute_uv=False)[0], rel=1e-14)


@pytest.mark.parametrize("angle", [0.0, 0.4, 2.0])
def test_stretch_of_a_uniform_strain_is_its_largest_principal_one(grid, angle):
    """Stretched 5 and .2 times along oblique axes and turned by 1 rad, triangles as well."""
    F = turned(1.0) @ turned(angle) @ np.diag([5.0, 0.2]) @ turned(-angle)
    assert grid.triangular.any()
    np.testing.assert_allclose(stretches(grid, F), 5.0, rtol=1e-12)


def test_a_turn_is_no_stretch(grid):
    np.testing.assert_allclose(stretches(grid, turned(2.5)), 1.0, rtol=1e-13)


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
