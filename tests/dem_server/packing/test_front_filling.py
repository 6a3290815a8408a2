"""Boundary inward filling: every disc touches two others, none overlaps, and the window is full."""

import numpy as np
import pytest
import shapely
from scipy.spatial import cKDTree
from window_case import ANGLE, OBLIQUE, SQUARE, rim

from coupler_protocol.interface.ring import build_ring
from dem_server.packing.front_filling import fill

R = 0.03


@pytest.fixture(scope="module", params=[SQUARE, OBLIQUE, ANGLE], ids=["square", "oblique", "angle"])
def filled(request):
    nodes = rim(request.param)
    ring = build_ring(nodes, R)
    radii = np.random.default_rng(0).uniform(0.75 * R, 1.25 * R, 1500)
    return request.param, ring, radii, *fill(nodes, ring.xy, ring.radius, radii)


def gaps(ring, xy, radius):
    """Pairs that are near and not within the ring, and their gaps [m]."""
    every, r = np.vstack([ring.xy, xy]), np.concatenate([ring.radius, radius])
    pairs = cKDTree(every).query_pairs(3.0 * R, output_type="ndarray")
    pairs = pairs[(pairs >= len(ring.xy)).any(axis=1)]
    return pairs, np.hypot(*(every[pairs[:, 1]] - every[pairs[:, 0]]).T) - r[pairs].sum(axis=1)


def test_every_disc_touches_two_that_were_there_before(filled):
    _, ring, _, xy, radius = filled
    pairs, gap = gaps(ring, xy, radius)
    assert gap.min() > -2e-9 * R
    later = pairs[np.abs(gap) < 2e-9 * R].max(axis=1)
    assert (np.bincount(later, minlength=len(ring.xy) + len(xy))[len(ring.xy) :] >= 2).all()


def test_discs_lie_inside_and_leave_no_hole(filled):
    corners, ring, _, xy, radius = filled
    assert shapely.contains_xy(shapely.Polygon(corners), xy).all()
    every, r = np.vstack([ring.xy, xy]), np.concatenate([ring.radius, radius])
    points = np.random.default_rng(1).uniform(corners.min(axis=0), corners.max(axis=0), (20000, 2))
    points = points[shapely.contains_xy(shapely.Polygon(corners), points)]
    away, near = cKDTree(every).query(points, 6)
    assert (away - r[near]).min(axis=1).max() < 1.25 * R  # nowhere room for the largest disc
    inner = shapely.Polygon(corners).buffer(-ring.radius.mean()).area
    assert np.pi * radius @ radius > 0.76 * inner


def test_radii_are_those_that_were_drawn(filled):
    _, _, radii, _, radius = filled
    assert len(np.unique(radius)) == len(radius) < len(radii)
    assert np.isin(radius, radii).all()
    assert radius.mean() == pytest.approx(R, rel=0.02)
