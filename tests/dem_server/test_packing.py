"""Packings: stress, porosity, coordination in windows of any shape; one seed, one packing."""

import numpy as np
import pytest
import shapely
from window_case import ANGLE, OBLIQUE, SQUARE, packed, rim, soil_discs

from coupler_protocol.interface import build_ring, polygon_area
from dem_server.balance import unbalanced_ratio
from dem_server.contacts import contact_forces
from dem_server.fields import contacts, coordination, porosity
from dem_server.motion import move_free
from dem_server.packing import in_strips, pack, spread_points
from dem_server.stress import mean_stress


def rested(corners, discs):
    """A packed window after friction has taken hold."""
    model, state = packed(corners, discs)
    for _ in range(1000):
        move_free(model, state, 0.0)
        contact_forces(model, state)
    return model, state


@pytest.mark.parametrize("how", ["relaxed", "inward"])
@pytest.mark.parametrize("corners", [SQUARE, OBLIQUE, ANGLE], ids=["square", "oblique", "angle"])
def test_a_packing_is_dense_and_at_its_stress(corners, how):
    model, state = rested(corners, soil_discs(packing=how))
    stress = mean_stress(contacts(state), polygon_area(corners))
    assert -0.5 * (stress[0] + stress[1]) == pytest.approx(100e3, rel=0.03)
    assert unbalanced_ratio(model, state, 0.0) < 1e-6
    assert 0.15 < porosity(model, state) < 0.175
    assert shapely.contains_xy(shapely.Polygon(corners), state.x[model.ring :]).all()


@pytest.mark.parametrize("how", ["relaxed", "inward"])
def test_the_papers_window(how):
    """2 m x 5.667 m, discs of 0.05 m (0.03 m gives the same figures within 0.003, 4.20-4.25 and 0.6 %)."""
    corners = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 17.0 / 3.0], [0.0, 17.0 / 3.0]])
    model, state = rested(corners, soil_discs(radius=0.05, packing=how))
    stress = mean_stress(contacts(state), polygon_area(corners))
    assert -0.5 * (stress[0] + stress[1]) == pytest.approx(100e3, rel=0.03)
    assert np.hypot(0.5 * (stress[0] - stress[1]), stress[2]) < 7e3  # nearly the same in all directions
    assert 0.153 < porosity(model, state) < 0.162
    inner = shapely.contains_xy(shapely.Polygon(corners).buffer(-0.2), state.x)
    number, loose = coordination(model, state, inner)
    assert 4.15 < number < 4.35
    assert loose <= 0.012


def test_stiffer_discs_come_closer_to_the_isostatic_coordination():
    model, soft = packed(SQUARE, soil_discs())
    _, hard = packed(SQUARE, soil_discs(confinement=30e3))
    assert 3.7 < coordination(model, hard)[0] < coordination(model, soft)[0]


def test_radii_follow_the_scene():
    model, state = packed(SQUARE, soil_discs(spread=0.1))
    radius = state.radius[model.ring :]
    assert radius.max() / radius.min() < 1.1 / 0.9 * 1.2
    assert radius.mean() == pytest.approx(0.03, rel=0.03)


def test_same_seed_same_bits_other_seed_other_packing():
    (_, one), (_, same), (_, other) = (packed(SQUARE, soil_discs(), seed) for seed in (1, 1, 2))
    assert one.disc.tobytes() == same.disc.tobytes()
    assert one.disc.tobytes() != other.disc.tobytes()


def test_a_window_smaller_than_a_disc_is_refused():
    ring = build_ring(rim(SQUARE), 0.1)
    with pytest.raises(ValueError, match="smaller radius"):
        pack(SQUARE, ring.xy, ring.radius, soil_discs(radius=0.6), np.random.default_rng(0))


def test_points_are_spread_evenly():
    points = spread_points(shapely.Polygon(ANGLE), 3000, np.random.default_rng(0))
    assert shapely.contains_xy(shapely.Polygon(ANGLE), points).all()
    in_corner = (points < 0.75).all(axis=1).sum()
    assert in_corner == pytest.approx(1000, abs=15)


def test_strips_keep_neighbours_together():
    xy = np.random.default_rng(0).random((1000, 2)) * [1.0, 3.0]
    jump = np.hypot(*np.diff(xy[in_strips(xy, 0.1)], axis=0).T)
    assert np.median(jump) < 0.1
