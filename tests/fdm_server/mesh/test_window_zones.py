"""Windows: their zones, their rim, and places where none can be."""

import numpy as np
import pytest
import shapely
from grid_cases import material, slope, window

from coupler_protocol.geometry import polygon_area
from fdm_server.mesh.grid import areas, build_grid, centroids
from fdm_server.mesh.grid_sides import surface_edges
from fdm_server.mesh.window_zones import open_rim_of, rim_of, window_zones
from tests.window_scenes import CIRCLE, L_SHAPE


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
    assert 0.5 * np.sum(xy[:, 0] * np.roll(xy[:, 1], -1) - xy[:, 1] * np.roll(xy[:, 0], -1)) == pytest.approx(34 / 3)


@pytest.mark.parametrize(("columns", "rows"), [((0, 5), (2, 4)), ((50, 54), (30, 35)), ((3, 6), (8, 11)), ((20, 25), (0, 3))])
def test_windows_at_the_boundary_are_refused(paper, columns, rows):
    with pytest.raises(ValueError, match="touches the boundary"):
        rim_of(paper, window_zones(paper, window(columns, rows)))


@pytest.mark.parametrize(("columns", "rows"), [((11, 20), (13, 20)), ((50, 65), (2, 5)), ((5, 9), (12, 14))])
def test_windows_above_the_surface_are_refused(paper, columns, rows):
    with pytest.raises(ValueError, match="beyond the ground surface"):
        window_zones(paper, window(columns, rows))


def test_rims_that_are_no_simple_loop_are_refused(paper):
    left, right = (window_zones(paper, window(c, (4, 6))) for c in ((20, 22), (30, 32)))
    with pytest.raises(ValueError, match="2 separate pieces"):
        rim_of(paper, left | right)
    corner = window_zones(paper, window((23, 24), (7, 8)))
    with pytest.raises(ValueError, match="single gridpoint"):
        rim_of(paper, left | corner)
    frame = window_zones(paper, window((30, 36), (15, 20))) & ~window_zones(paper, window((32, 33), (17, 18)))
    with pytest.raises(ValueError, match="the window has a hole"):
        rim_of(paper, frame)


def drawn(polygon):
    return window(None, None, polygon)


@pytest.mark.parametrize("shape", [L_SHAPE, CIRCLE], ids=["L", "circle"])
def test_a_polygon_takes_the_zones_whose_centres_it_holds(paper, shape):
    polygon = np.add(shape, (8.0, 1.0))
    mask = window_zones(paper, drawn(polygon))
    inside = shapely.contains_xy(shapely.Polygon(polygon), *centroids(paper.xy, paper.zones).T)
    np.testing.assert_array_equal(mask, inside)
    rim = paper.xy[rim_of(paper, mask)]
    assert polygon_area(rim) == pytest.approx(mask.sum() / 9, rel=1e-12)
    assert polygon_area(rim) == pytest.approx(shapely.Polygon(polygon).area, rel=0.05)
    np.testing.assert_allclose(np.hypot(*(np.roll(rim, -1, axis=0) - rim).T), 1 / 3)


def test_a_rectangle_as_a_polygon_is_the_window_of_its_columns_and_rows(paper):
    box = [(11.0, 5.0), (13.0, 5.0), (13.0, 5 + 17 / 3), (11.0, 5 + 17 / 3)]
    np.testing.assert_array_equal(window_zones(paper, drawn(box)), window_zones(paper, window()))


def test_a_side_along_the_face_is_straight_where_columns_run_along_it():
    """In a grid with fit = "face" the side of a window follows a line of its columns: oblique segments of one direction."""
    grid = build_grid(slope(2 / 3, [(0.0, 4.0), (3.0, 4.0), (13.0, 12.0), (20.0, 12.0)], fit="face"))
    by_columns = window_zones(grid, window((12, 14), (6, 11)))
    hull = shapely.convex_hull(shapely.MultiPoint(grid.xy[rim_of(grid, by_columns)]))
    mask = window_zones(grid, drawn(hull.exterior.coords[:-1]))
    np.testing.assert_array_equal(mask, by_columns)
    rim = grid.xy[rim_of(grid, mask)]
    side = np.roll(rim, -1, axis=0) - rim
    oblique = side[(np.abs(side[:, 1]) > 1e-9) & (np.abs(side[:, 0]) > 1e-9)]
    assert len(oblique) == 12
    angle = np.degrees(np.arctan2(oblique[:, 1], oblique[:, 0])) % 180.0
    lines, rows = np.unique(np.round(angle, 6), return_counts=True)
    assert rows.tolist() == [6, 6]  # two straight sides
    assert 38.7 < lines[0] < lines[1] < 70.0  # steeper than the face, and more so with the distance from it
    assert polygon_area(rim) == pytest.approx(areas(grid.xy, grid.zones)[mask].sum(), rel=1e-12)


def test_triangles_inside_the_ground_may_belong_to_a_window():
    """Where a material's top cuts cells, triangles are zones like others."""
    top = material("below")
    top.top = [(0.0, 2.0), (20.0, 7.0)]
    grid = build_grid(slope(0.5, ((0.0, 10.0), (20.0, 10.0)), [material(), top], fit="profile", height=10.0))
    mask = window_zones(grid, drawn([(6.0, 2.0), (12.0, 2.0), (12.0, 6.5), (6.0, 6.5)]))
    assert grid.triangular[mask].sum() > 3
    rim = grid.xy[rim_of(grid, mask)]
    assert polygon_area(rim) == pytest.approx(areas(grid.xy, grid.zones)[mask].sum(), rel=1e-12)


@pytest.mark.parametrize(
    ("polygon", "words"),
    [
        ([(2.0, 9.0), (4.0, 9.0), (4.0, 10.0)], "window 'band' contains no zones"),
        ([(6.0, 3.0), (10.0, 3.0), (7.0, 8.0), (6.0, 8.0)], r"touches the boundary of the grid at \([67]\.?\d*, [67]"),
        ([(0.1, 1.0), (3.0, 1.0), (3.0, 3.0), (0.1, 3.0)], r"touches the boundary of the grid at \(0, "),
        ([(9, 1), (12, 1), (12, 3), (10.6, 3), (10.6, 3.4), (12, 3.4), (12, 6), (9, 6), (9, 3.4),
          (10.55, 3.4), (10.55, 3), (9, 3)],
         r"2 separate pieces, the smallest at \(10\.5, 2\)"),
        ([(9, 1), (11, 1), (11, 3), (13, 3), (13, 5), (10.9, 5), (10.9, 3.1), (9, 3.1)], r"single gridpoint at \(11, 3\)"),
        ([(9, 1), (13, 1), (13, 5), (9, 5), (9, 3), (10, 3), (10, 4), (12, 4), (12, 2), (10, 2), (10, 2.9), (9, 2.9)],
         r"the window has a hole at \(11, 3\): add the zones"),
    ],
    ids=["empty", "face", "side", "pieces", "pinched", "hole"],
)  # fmt: skip
def test_polygons_whose_zones_are_no_window_are_refused_with_the_place(paper, polygon, words):
    with pytest.raises(ValueError, match=words):
        rim_of(paper, window_zones(paper, drawn(polygon)))


# -- windows that reach the ground surface -----------------------------------------------------------------------------------


def open_rim(grid, polygon):
    return open_rim_of(grid, window_zones(grid, drawn(polygon)))


@pytest.mark.parametrize(
    "polygon",
    [
        [(14.0, 8.0), (17.0, 8.0), (17.0, 12.5), (14.0, 12.5)],
        [(8.0, 5.0), (10.0, 5.0), (10.0, 9.5), (6.5, 9.5), (6.5, 7.0)],
        [(1.0, 2.0), (6.0, 2.0), (6.0, 8.0), (1.0, 8.0)],
    ],
    ids=["crest", "face", "toe"],
)
def test_an_open_rim_runs_from_the_surface_around_the_window_to_the_surface(paper, polygon):
    """Its chain and the surface close the outline of the zones, counter-clockwise; only its ends are on the surface."""
    mask = window_zones(paper, drawn(polygon))
    rim = open_rim_of(paper, mask)
    outline = paper.xy[rim.outline]
    assert polygon_area(outline) == pytest.approx(areas(paper.xy, paper.zones[mask]).sum(), rel=1e-12)
    surface = np.unique(surface_edges(paper, paper.zones))
    assert np.isin(rim.nodes, surface).tolist() == [True, *[False] * (len(rim.nodes) - 2), True]
    assert np.isin(rim.surface, surface).all()
    left = np.delete(paper.zones, np.flatnonzero(mask), axis=0)
    assert np.isin(rim.nodes, left).all()  # the rim stays, the surface of the window goes with its zones
    assert not np.isin(rim.surface, left).any()


@pytest.mark.parametrize(
    ("polygon", "words"),
    [
        ([(-1.0, 2.0), (3.0, 2.0), (3.0, 6.0), (-1.0, 6.0)], "rim touches the boundary of the grid at"),
        ([(14.0, -1.0), (17.0, -1.0), (17.0, 13.0), (14.0, 13.0)], "rim touches the boundary of the grid at"),
        ([(14.0, 3.0), (17.0, 3.0), (17.0, 6.0), (14.0, 6.0)], "does not reach the ground surface"),
        (
            [(13.0, 8.0), (19.0, 8.0), (19.0, 13.0), (17.0, 13.0), (17.0, 10.0), (15.0, 10.0), (15.0, 13.0), (13.0, 13.0)],
            "reaches the ground surface in 2 stretches",
        ),
    ],
)
def test_open_rims_that_are_no_single_chain_are_refused(paper, polygon, words):
    with pytest.raises(ValueError, match=words):
        open_rim(paper, polygon)
