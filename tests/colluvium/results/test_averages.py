"""Means over a region against closed forms: areas of discs in polygons and circles, stress of a lattice and of a box."""

from types import SimpleNamespace

import numpy as np
import pytest
import shapely

from colluvium.results.averages import average_stress, discs_inside, porosity, share_reached
from coupler_protocol.geometry import disc_in_polygon
from coupler_protocol.measures.regions import disc_in_circle, lens


class Frame(SimpleNamespace):
    """Fields of a frame."""

    def __contains__(self, name):
        return hasattr(self, name)


def many_sided(xy, radius):
    """A polygon of 2,048 sides with the disc's area."""
    sides = 2048
    exact = radius * np.sqrt(2.0 * np.pi / sides / np.sin(2.0 * np.pi / sides))
    return shapely.Point(xy).buffer(exact, quad_segs=sides // 4)


L_SHAPE = np.array([[0.0, 0.0], [1.0, 0.2], [1.1, 0.7], [0.5, 0.5], [0.4, 1.2], [-0.2, 1.0]])


def test_discs_in_an_oblique_polygon_that_is_not_convex():
    rng = np.random.default_rng(1)
    xy, radius = rng.uniform(-0.5, 1.5, (300, 2)), rng.uniform(0.02, 0.7, 300)
    ring = np.vstack([L_SHAPE, L_SHAPE[:1]])
    expected = [many_sided(p, r).intersection(shapely.Polygon(L_SHAPE)).area for p, r in zip(xy, radius, strict=True)]
    np.testing.assert_allclose(disc_in_polygon(xy, radius, ring), expected, atol=1e-6)
    assert (np.array(expected) == 0.0).any()  # some lie outside
    assert np.isclose(expected, np.pi * radius**2, rtol=1e-9).any()  # some inside


def test_discs_in_a_circle():
    rng = np.random.default_rng(2)
    xy, radius = rng.uniform(-1.0, 1.0, (300, 2)), rng.uniform(0.02, 0.8, 300)
    circle = many_sided((0.0, 0.0), 0.5)
    expected = [many_sided(p, r).intersection(circle).area for p, r in zip(xy, radius, strict=True)]
    np.testing.assert_allclose(disc_in_circle(xy, radius, 0.5), expected, atol=2e-6)


def test_the_lens_of_two_discs_that_hardly_overlap():
    """Two segments of height h / 2 each: 2 (4/3 sqrt(2 R h / 2) h / 2) to first order; nothing cancels."""
    h = 1e-6
    area = lens(np.array([2.0 - h]), np.ones(1), np.ones(1))
    assert area[0] == pytest.approx(8.0 / 3.0 * np.sqrt(h) * 0.5 * h, rel=1e-4)


def lattice(turned, R=0.1, side=12):
    """A square lattice of touching discs, each row carrying N along the first axis; as a frame."""
    at = np.stack(np.meshgrid(np.arange(side), np.arange(side), indexing="ij"), axis=-1).reshape(-1, 2)
    number = np.arange(side * side).reshape(side, side)
    ends = np.column_stack([number[:-1].ravel(), number[1:].ravel()])
    c, s = np.cos(turned), np.sin(turned)
    discs = Frame(xy=2.0 * R * at @ np.array([[c, s], [-s, c]]), radius=np.full(len(at), R))
    return discs, Frame(ends=ends, normal_force=np.full(len(ends), 50.0), shear_force=np.full(len(ends), 20.0))


@pytest.mark.parametrize("turned", [0.0, 0.4])
def test_a_lattice_has_the_stress_of_its_rows(turned):
    """Forces F along unit vectors a, one a cell of side 2 R: stress -sym(F (x) a) / 2 R; porosity 1 - pi/4."""
    discs, contacts = lattice(turned)
    along = np.array([np.cos(turned), np.sin(turned)])
    across = np.array([-along[1], along[0]])
    force = 50.0 * along + 20.0 * across
    moment = np.outer(force, along) / 0.2
    expected = -np.array([moment[0, 0], moment[1, 1], 0.5 * (moment[0, 1] + moment[1, 0])])
    middle = discs.xy[5 * 12 + 5] + 0.1 * (along + across)
    cell = middle + 0.6 * np.array([-along - across, along - across, along + across, -along + across])
    np.testing.assert_allclose(average_stress(discs, contacts, cell), expected, rtol=1e-9)
    assert porosity(discs, cell) == pytest.approx(1.0 - 0.25 * np.pi, rel=1e-9)
    round_ = average_stress(discs, contacts, (*middle, 0.9))
    np.testing.assert_allclose(round_, expected, rtol=0.08)  # a circle cuts rows anywhere
    assert porosity(discs, (*middle, 0.9)) == pytest.approx(1.0 - 0.25 * np.pi, rel=0.05)


def test_regions_that_are_none():
    discs, contacts = lattice(0.0)
    for region in ((0.0, 0.0), (0.0, 0.0, -1.0), [[0.0, 0.0], [1.0, 1.0]], [[0, 0], [1, 1], [1, 0], [0, 1]]):
        with pytest.raises(ValueError, match="a region is"):
            average_stress(discs, contacts, region)


def test_porosity_counts_overlaps_within_a_stone_once():
    """Two discs of one clump at half their width, beside a third: in the frame of a run there is no contact between them."""
    discs = SimpleNamespace(xy=np.array([[0.0, 0.0], [0.1, 0.0], [0.5, 0.0]]), radius=np.full(3, 0.1))
    union = shapely.union_all(shapely.buffer(shapely.points(discs.xy), discs.radius, quad_segs=2000)).area
    assert porosity(discs, (0.25, 0.0, 1.0)) == pytest.approx(1.0 - union / np.pi, rel=1e-6)


@pytest.mark.parametrize("region", [(50.0, 50.0, 1.0), [[-9.0, -9.0], [-8.0, -9.0], [-8.0, -8.0]]])
def test_where_there_are_no_discs_there_is_no_mean_stress(region):
    discs, contacts = lattice(0.0)
    assert discs_inside(discs, region) == 0
    assert np.isnan(average_stress(discs, contacts, region)).all()
    assert porosity(discs, region) == pytest.approx(1.0, abs=1e-12)


def test_discs_that_reach_into_a_region_are_counted():
    """Of a lattice of spacing 0.2, radius 0.1: a circle about a disc that ends between it and its neighbours, then beyond."""
    discs, contacts = lattice(0.0)
    x, y = discs.xy[5 * 12 + 5]
    for radius, count in ((0.05, 1), (0.0999, 1), (0.11, 5), (0.19, 9)):
        assert discs_inside(discs, (x, y, radius)) == count
        assert np.isfinite(average_stress(discs, contacts, (x, y, radius))).all()


@pytest.mark.parametrize("region", [(0.1, 0.0, 0.32), (0.25, 0.0, 1.0), [[-0.1, -0.3], [0.5, -0.2], [0.4, 0.6]]])
def test_porosity_with_solid_stones_is_that_of_their_polygons(region):
    """Two discs in a stone of six corners, one of soil that reaches into it and one beside it; a second stone without discs."""
    discs = SimpleNamespace(
        xy=np.array([[0.0, 0.0], [0.2, 0.05], [0.1, 0.19], [0.45, 0.1]]), radius=np.array([0.09, 0.1, 0.08, 0.1])
    )
    discs.stone = np.array([0, 0, -1, -1])
    stone = np.array([[-0.1, -0.1], [0.2, -0.12], [0.32, 0.0], [0.2, 0.18], [0.0, 0.13], [-0.12, 0.02]])
    soil = shapely.union_all([many_sided(xy, r) for xy, r in zip(discs.xy[2:], discs.radius[2:], strict=True)])
    shape = many_sided(region[:2], region[2]) if len(np.shape(region)) == 1 else shapely.Polygon(region)
    solid = soil.union(shapely.Polygon(stone)).intersection(shape).area
    found = porosity(discs, region, [stone, stone + 0.9])
    assert found == pytest.approx(1.0 - solid / shape.area, abs=2e-6)
    assert porosity(discs, region) > found + 0.005


@pytest.mark.parametrize("turned", [0.0, 0.4])
def test_the_share_of_a_region_that_discs_fill(turned):
    """A square of 12 x 12 discs of 0.1 m, and half a mean radius around: regions inside, across its side, around all of it."""
    discs, _ = lattice(turned)
    c, s = np.cos(turned), np.sin(turned)
    middle = discs.xy.mean(axis=0)
    along, across = np.array([c, s]), np.array([-s, c])
    assert share_reached(discs, (*middle, 0.9)) == 1.0
    assert share_reached(discs, (*(middle + 1.2 * along), 0.9)) == pytest.approx(0.58, abs=0.03)  # its centre on the side
    corners = [middle + 3.0 * (a * along + b * across) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    assert share_reached(discs, corners) == pytest.approx((2.6 / 6.0) ** 2, rel=0.06)
    assert share_reached(discs, (50.0, 50.0, 1.0)) == 0.0
