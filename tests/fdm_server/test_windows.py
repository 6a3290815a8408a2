"""Windows: their zones, their rim, and places where none can be."""

import numpy as np
import pytest
from grid_cases import slope, window

from fdm_server.grid import build_grid
from fdm_server.windows import rim_of, window_zones


@pytest.fixture(scope="module")
def paper():
    return build_grid(slope())


def test_paper_window_has_102_zones_and_46_rim_gridpoints(paper):
    mask = window_zones(paper, window())
    rim = rim_of(paper, mask)
    assert (mask.sum(), len(rim)) == (6 * 17, 46)
    xy = paper.xy[rim]
    np.testing.assert_allclose([xy.min(axis=0), xy.max(axis=0)], [[11, 5], [13, 5 + 17 / 3]])


def test_rim_runs_counter_clockwise_along_zone_sides(paper):
    xy = paper.xy[rim_of(paper, window_zones(paper, window()))]
    side = np.roll(xy, -1, axis=0) - xy
    np.testing.assert_allclose(np.hypot(*side.T), 1 / 3)
    assert 0.5 * np.sum(xy[:, 0] * np.roll(xy[:, 1], -1) - xy[:, 1] * np.roll(xy[:, 0], -1)) == pytest.approx(
        34 / 3
    )


@pytest.mark.parametrize(
    ("columns", "rows"), [((0, 5), (2, 4)), ((50, 54), (30, 35)), ((3, 6), (8, 11)), ((20, 25), (0, 3))]
)
def test_windows_at_the_boundary_are_refused(paper, columns, rows):
    with pytest.raises(ValueError, match="touches the boundary"):
        rim_of(paper, window_zones(paper, window(columns, rows)))


@pytest.mark.parametrize(("columns", "rows"), [((11, 20), (13, 20)), ((50, 65), (2, 5)), ((5, 9), (12, 14))])
def test_windows_above_the_surface_are_refused(paper, columns, rows):
    with pytest.raises(ValueError, match="beyond the ground surface"):
        window_zones(paper, window(columns, rows))


def test_rims_that_are_no_simple_loop_are_refused(paper):
    left, right = (window_zones(paper, window(c, (4, 6))) for c in ((20, 22), (30, 32)))
    with pytest.raises(ValueError, match="not one piece"):
        rim_of(paper, left | right)
    corner = window_zones(paper, window((23, 24), (7, 8)))
    with pytest.raises(ValueError, match="single gridpoint"):
        rim_of(paper, left | corner)
    frame = window_zones(paper, window((30, 36), (15, 20))) & ~window_zones(paper, window((32, 33), (17, 18)))
    with pytest.raises(ValueError, match="not one piece"):
        rim_of(paper, frame)
