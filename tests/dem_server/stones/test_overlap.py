"""Intrusion of polygons against shapely, and the cases that one test alone would miss."""

import numpy as np
import pytest
import shapely

from dem_server.stones.overlap import edges_near, fits, inside, intrudes
from dem_server.stones.polygons import placed, random_outline

SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def moved(polygon, x, y):
    return polygon + np.array([x, y])


def both_ways(a, b, gap=0.0):
    found = {intrudes(a, len(a), b, len(b), gap), intrudes(b, len(b), a, len(a), gap)}
    assert len(found) == 1
    return found.pop()


def test_random_polygons_agree_with_shapely():
    rng = np.random.default_rng(0)
    answers = []
    for _ in range(600):
        a, b = (
            placed(random_outline(n, 1.8, rng), rng.random(2), np.pi * rng.random(), size) for n, size in ((7, 0.4), (11, 0.6))
        )
        gap = 0.2 * rng.random()
        answers.append(shapely.Polygon(a).distance(shapely.Polygon(b)) < gap)
        assert both_ways(a, b, gap) == answers[-1]
    assert 100 < sum(answers) < 500


def test_one_inside_the_other_without_crossing_edges():
    assert not edges_near(SQUARE, 4, 0.1 * SQUARE, 4, 0.0)
    assert both_ways(SQUARE, 0.1 * SQUARE)


def test_a_cross_has_no_corner_inside():
    bar = SQUARE * [3.0, 0.3]
    assert not any(inside(SQUARE, 4, *corner) for corner in bar)
    assert not any(inside(bar, 4, *corner) for corner in SQUARE)
    assert both_ways(SQUARE, bar)


def test_a_gap_is_measured_corner_to_edge_and_corner_to_corner():
    assert both_ways(SQUARE, moved(SQUARE, 2.1, 0.5), 0.11)
    assert not both_ways(SQUARE, moved(SQUARE, 2.1, 0.5), 0.09)
    assert both_ways(SQUARE, moved(SQUARE, 2.3, 2.4), 0.501)
    assert not both_ways(SQUARE, moved(SQUARE, 2.3, 2.4), 0.499)


@pytest.mark.parametrize(
    ("x", "y", "expected"), [(-0.7, -0.7, True), (-0.6, -0.6, False), (1.0, 1.0, False), (-1.0, -2.0, False)]
)
def test_the_domains_edges_count_where_no_corner_is_outside(x, y, expected):
    """An L-shaped domain: a stone across its inner corner (0, 0) has all corners inside."""
    domain = np.array([[-3.0, -3.0], [3.0, -3.0], [3.0, 0.0], [0.0, 0.0], [0.0, 3.0], [-3.0, 3.0]])
    diamond = np.array([[0.0, -1.27], [1.27, 0.0], [0.0, 1.27], [-1.27, 0.0]])
    world = moved(diamond, x, y)[None]
    there = np.zeros(1, dtype=bool)
    place = np.array([[x, y, 0.0, 1.0]])
    assert fits(0, world, np.array([4]), place, np.array([1.3]), there, domain, 0.0) == expected
