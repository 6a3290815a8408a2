"""A rigid stone has the mean stress that its contacts give it, spread over its polygon; nothing is lost or counted twice."""

import numpy as np
import pytest
import shapely
from window_case import OBLIQUE, packed_with_stones, soil_discs

from coupler_protocol.geometry import polygon_area
from dem_server.insitu.contact_stress import mean_stress
from dem_server.insitu.stone_stress import circle_stress_with_stones, stone_stress
from dem_server.model import build_model
from dem_server.packing.packing import Packing
from dem_server.pairs import contacts
from dem_server.step.clumps import make_clumps
from dem_server.step.contact_pass import contact_forces
from dem_server.step.neighbours import rebuild
from dem_server.stones import bodies

R = 0.03
BAR = R * np.array([[-3.0, -1.0], [3.0, -1.0], [3.0, 1.0], [-3.0, 1.0]])  # of three discs
KN = 2.5e7  # of two discs in series


def pressed_bar(degrees, overlap=1e-5):
    """A bar of three discs between two loose discs, pressed along its axis: state, its polygon, the force, the axis (2,)."""
    axis = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
    across = np.array([-axis[1], axis[0]])
    along = np.array([-2.0, 0.0, 2.0, -4.0, 4.0]) * R + overlap * np.array([0.0, 0.0, 0.0, 1.0, -1.0])
    model, state = build_model(np.empty((0, 2)), np.empty(0), Packing(np.outer(along, axis), np.full(5, R)), soil_discs())
    state.clumps = make_clumps(np.array([0, 0, 0, -1, -1]), state.x, np.zeros((1, 2)), np.array([R * R]))
    rebuild(model, state)
    contact_forces(model, state)
    return state, BAR @ np.array([axis, across]), KN * overlap, axis


@pytest.mark.parametrize("degrees", [0.0, 37.0])
def test_a_pressed_bar(degrees):
    """sigma = -F L / A along the axis, L the distance of its two contacts: force over the mean width A / L."""
    state, bar, force, axis = pressed_bar(degrees)
    expected = -force * (6.0 * R - 1e-5) / (12.0 * R * R) * np.outer(axis, axis)
    expected = [expected[0, 0], expected[1, 1], expected[0, 1]]
    np.testing.assert_allclose(stone_stress(state, [bar])[0], expected, rtol=1e-9, atol=1e-6 * force / R)
    inside = circle_stress_with_stones(state, [bar], np.zeros((1, 2)), 0.9 * R)
    np.testing.assert_allclose(inside[0], expected, rtol=1e-3, atol=1e-6 * force / R)
    beside = 3.0 * R * np.array([[-axis[1], axis[0]]])
    np.testing.assert_array_equal(circle_stress_with_stones(state, [bar], beside, 0.9 * R), np.zeros((1, 3)))


def test_a_circle_around_everything_gives_the_mean():
    model, state, found = packed_with_stones(OBLIQUE, content=0.3)
    model = bodies.form_stones(model, state, found.outlines, "clump")
    around = circle_stress_with_stones(state, found.outlines, np.array([[0.4, 0.7]]), 5.0)[0]
    np.testing.assert_allclose(around, mean_stress(contacts(state), np.pi * 25.0), rtol=1e-10, atol=1e-9 * np.abs(around).max())


def test_circles_side_by_side_share_a_stone():
    """The stress of a stone counts in a circle with the area it has there."""
    state, bar, force, axis = pressed_bar(20.0)
    mean, shape = stone_stress(state, [bar])[0], shapely.Polygon(bar)
    centre = 3.0 * R * axis  # half of the bar's end, and half a loose disc's branch
    found = circle_stress_with_stones(state, [bar], centre[None], R)[0] * np.pi * R**2
    share = shape.intersection(shapely.Point(centre).buffer(R, quad_segs=200)).area
    branch = force * (R - 1e-5) * np.array([axis[0] ** 2, axis[1] ** 2, axis[0] * axis[1]])
    np.testing.assert_allclose(found, share * mean - branch, rtol=1e-3)
    assert share == pytest.approx(0.5 * np.pi * R**2, rel=1e-3)
    assert polygon_area(bar) == pytest.approx(12.0 * R**2)
