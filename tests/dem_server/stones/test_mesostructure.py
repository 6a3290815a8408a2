"""Mesostructures: content, gaps, and the distributions that stones were drawn from."""

from types import SimpleNamespace

import numpy as np
import pytest
import scipy.stats
import shapely
from window_case import ANGLE, OBLIQUE, rim, stones_table

from coupler_protocol.geometry import polygon_area
from dem_server.stones.mesostructure import draw, draw_sizes, filled

PAPER = np.array([[11.0, 5.0], [13.0, 5.0], [13.0, 32.0 / 3.0], [11.0, 32.0 / 3.0]])
SIZE = stones_table().size


def check_places(found, domain, gap):
    """No stone intrudes on another one or on the edge."""
    polygons = [shapely.Polygon(outline) for outline in found.outlines]
    tree, edge = shapely.STRtree(polygons), shapely.Polygon(domain)
    pairs = tree.query(polygons, predicate="dwithin", distance=gap * (1.0 - 1e-12))
    assert (pairs[0] == pairs[1]).all()
    assert shapely.contains(edge, polygons).all()
    assert shapely.distance(edge.exterior, polygons).min() >= gap * (1.0 - 1e-12)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("content", "gap"), [(0.3, 0.03), (0.45, 0.03), (0.6, 0.03), (0.6, 0.0), (0.7, 0.0), (0.7, 0.01)])
def test_content_is_exact_and_no_stone_intrudes(content, gap, seed):
    found = draw(PAPER, stones_table(content=content, gap=gap), np.random.default_rng(seed))
    assert found.area / polygon_area(PAPER) == pytest.approx(content, rel=1e-12)
    check_places(found, PAPER, gap)
    assert all(SIZE.min <= s <= SIZE.max for s in found.size)
    assert ((found.flatness >= 1.0) & (found.flatness <= 1.8)).all()
    assert {len(outline) for outline in found.outlines} == set(range(6, 13))


@pytest.mark.parametrize("corners", [2.0 * OBLIQUE, 2.0 * ANGLE], ids=["oblique", "angle"])
def test_windows_of_other_shapes(corners):
    found = draw(rim(corners), stones_table(content=0.5), np.random.default_rng(0))
    assert found.area / polygon_area(corners) == pytest.approx(0.5, rel=1e-12)
    check_places(found, corners, 0.03)


def test_same_seed_same_stones_other_seed_others():
    one, same, other = (draw(PAPER, stones_table(), np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert all(a.tobytes() == b.tobytes() for a, b in zip(one.outlines, same.outlines, strict=True))
    assert one.outlines[0].tobytes() != other.outlines[0].tobytes()


def test_sizes_are_lognormal_within_their_limits():
    sizes = draw_sizes(200.0, SIZE, np.random.default_rng(0))
    mu = np.log(SIZE.mean) - 0.5 * SIZE.sigma**2
    whole = scipy.stats.norm(mu, SIZE.sigma).cdf
    low, high = whole(np.log([SIZE.min, SIZE.max]))
    test = scipy.stats.kstest(sizes, lambda s: (whole(np.log(s)) - low) / (high - low))
    assert len(sizes) > 3000
    assert test.pvalue > 0.01
    assert np.pi / 4 * (sizes**2).sum() == pytest.approx(200.0, rel=1e-13)
    assert (np.diff(sizes) <= 0.0).all()


@pytest.mark.parametrize("area", [0.012, 0.05, 0.3])
def test_a_few_stones_cover_a_small_area_exactly(area):
    for seed in range(50):
        sizes = draw_sizes(area, SIZE, np.random.default_rng(seed))
        assert np.pi / 4 * (sizes**2).sum() == pytest.approx(area, rel=1e-12)
        assert SIZE.min <= sizes.min() <= sizes.max() <= SIZE.max


def test_azimuths_and_places_are_uniform():
    domain = np.array([[0.0, 0.0], [30.0, 0.0], [30.0, 20.0], [0.0, 20.0]])
    found = draw(domain, stones_table(content=0.1, gap=0.0), np.random.default_rng(4))
    centres = np.array([shapely.Polygon(outline).centroid.coords[0] for outline in found.outlines])
    assert scipy.stats.kstest(found.azimuth / np.pi, "uniform").pvalue > 0.01
    for axis, length in enumerate((30.0, 20.0)):
        assert scipy.stats.kstest(centres[:, axis] / length, "uniform").pvalue > 0.01


def test_growth_takes_over_where_random_places_run_out():
    found = draw(PAPER, stones_table(content=0.6, gap=0.0), np.random.default_rng(0))
    assert found.sweeps > 0
    assert draw(PAPER, stones_table(content=0.3, gap=0.0), np.random.default_rng(0)).sweeps == 0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"content": 0.75, "gap": 0.2}, "no room for a content of 0.75"),
        ({"content": 0.7, "gap": 0.03}, r"(?s)would fill (8[6-9]|9\d) % .*a content up to 0\.6\d, a gap up to 0\.01\d m"),
        ({"content": 0.66, "gap": 0.03}, r"they jam at 0\.6[0-5]"),
        ({"content": 0.3, "gap": 3.0}, "no room for a content of 0.3"),
        ({"content": 1e-5}, "choose smaller stones"),
    ],
)
def test_what_cannot_be_is_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        draw(PAPER, stones_table(**changes), np.random.default_rng(0))


@pytest.mark.parametrize("gap", [0.0, 0.1])
def test_the_room_is_that_of_grown_stones_in_a_smaller_domain(gap):
    """Squares of side s grow to (s + g)^2 less the corners that a circle cuts off; the domain loses g on each side."""
    side = 0.5
    square = np.array([[0.0, 0.0], [side, 0.0], [side, side], [0.0, side]])
    grown = side**2 + 2.0 * side * gap + np.pi * gap**2 / 4.0
    room = (2.0 - gap) * (17.0 / 3.0 - gap)
    assert filled([square, square + 1.0], PAPER, gap) == pytest.approx(2.0 * grown / room, rel=2e-3)  # arcs of 32 sides


def test_stones_of_one_size_are_possible():
    size = SimpleNamespace(mean=0.3, sigma=0.01, min=0.25, max=0.35)
    found = draw(PAPER, stones_table(size=size), np.random.default_rng(0))
    assert found.area / polygon_area(PAPER) == pytest.approx(0.45, rel=1e-12)
    assert np.ptp(found.size) < 0.05
