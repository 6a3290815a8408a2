"""Rings: geometry, sides, growth of zones."""

from math import pi, sin
from types import SimpleNamespace

import numpy as np
import pytest
from grid_cases import material

from coupler_protocol.scene.tables.grid import Grid
from fdm_server.mesh.fitted_net import aspects
from fdm_server.mesh.grid import areas, build_grid
from fdm_server.mesh.grid_sides import edges_of, side_of

SHARE = {"full": 1.0, "half": 0.5, "quarter": 0.25}


def ring(**table):
    grid = Grid(kind="ring", **({"inner": 1.0, "outer": 8.0, "around": 24} | table))
    return build_grid(SimpleNamespace(grid=grid, material=[material()]))


@pytest.mark.parametrize("part", SHARE)
@pytest.mark.parametrize("growth", [None, 1.0, 1.12])
def test_area_is_that_of_the_polygons(part, growth):
    grid = ring(part=part, growth=growth)
    angle = 2 * pi * SHARE[part] / 24
    area = areas(grid.xy, grid.zones)
    assert area.min() > 0
    assert area.sum() == pytest.approx(24 * 0.5 * sin(angle) * (8.0**2 - 1.0), rel=1e-12)
    assert (grid.column.max() + 1, len(grid.zones)) == (24, 24 * (grid.row.max() + 1))
    assert aspects(grid.xy, grid.zones).max() < (1.2 if growth is None else 4.2)


@pytest.mark.parametrize(
    ("part", "sides"), [("full", "inner outer"), ("half", "inner outer bottom"), ("quarter", "inner outer left bottom")]
)
def test_sides(part, sides):
    grid = ring(part=part)
    radius = np.hypot(*grid.xy.T)
    expected = {"inner": np.abs(radius - 1) < 1e-9, "outer": np.abs(radius - 8) < 1e-9}
    expected |= {"left": grid.xy[:, 0] == 0.0, "bottom": grid.xy[:, 1] == 0.0}
    for side in sides.split():
        assert np.array_equal(side_of(grid, side), np.flatnonzero(expected[side]))
    for side in {"inner", "outer", "left", "bottom", "top"} - set(sides.split()):
        with pytest.raises(ValueError, match="use one of inner, outer"):
            edges_of(grid, side)


def test_radial_sizes_grow_by_the_ratio_from_about_the_width():
    grid = ring(growth=1.15, part="quarter")
    radius = np.unique(np.round(np.hypot(*grid.xy.T), 12))
    sizes = np.diff(radius)
    np.testing.assert_allclose(sizes[1:] / sizes[:-1], 1.15, rtol=1e-9)
    assert sizes[0] == pytest.approx(pi / 48, rel=0.15)
