"""Room for discs in windows of any shape: as wide as the rule for rectangles asks, and no arm too narrow."""

import numpy as np
import pytest
import shapely

from fdm_server.checks.room_for_discs import corners_as_text, lack_of_room

RECTANGLE = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 0.8], [0.0, 0.8]])


def turned(corners, angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(corners, dtype=float) @ [[c, s], [-s, c]]


@pytest.mark.parametrize("angle", [0.0, 0.4, 1.1])
def test_a_rectangle_is_eight_discs_wide_at_any_angle(angle):
    assert lack_of_room(turned(RECTANGLE, angle), 0.05) is None
    what, remedy = lack_of_room(turned(RECTANGLE, angle), 0.0501)
    assert "too small for discs of radius 0.0501 m" in what
    assert "radius at most 0.05 m" in remedy


@pytest.mark.parametrize(("width", "fits"), [(0.41, True), (0.39, False)])
@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_an_arm_is_four_discs_wide(width, fits, angle):
    """An arm of the L, 1 m long, is wide enough for discs of .05 m from .4 m on; else its end is named."""
    shape = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0 - width), (2.0, 1.0 - width), (2.0, 1.0), (0.0, 1.0)]
    found = lack_of_room(turned(shape, angle), 0.05)
    assert (found is None) is fits
    if not fits:
        x, y = turned([(2.0, 1.0)], angle)[0]
        assert "narrower than 4 discs" in found[0]
        place = np.array(found[0].split("at (")[1].split(")")[0].split(", "), dtype=float)
        assert np.hypot(*(place - (x, y))) < 0.42


def test_two_rooms_joined_by_a_neck_are_refused_there():
    rooms = shapely.union_all([shapely.box(0, 0, 1, 1), shapely.box(1.2, 0, 2.2, 1), shapely.box(0.9, 0.4, 1.3, 0.7)])
    what, _ = lack_of_room(np.array(rooms.normalize().exterior.coords)[:-1], 0.05)
    assert "at (1.1, 0.5" in what


def test_corners_of_wedges_and_staircases_are_no_arms():
    wedge = [(0.0, 0.0), (3.0, 0.0), (3.0, 1.5), (1.5, 1.5)]  # 45 degrees
    assert lack_of_room(np.array(wedge), 0.05) is None
    stairs = [(0, 0), (2, 0), (2, 2), (1.5, 2), (1.5, 1.5), (1, 1.5), (1, 1), (0.5, 1), (0.5, 0.5), (0, 0.5)]
    assert lack_of_room(np.array(stairs), 0.05) is None


def test_the_outline_of_a_window_with_a_tip_is_shown():
    """A square window through leaning columns: its zones end in a tip, which the message shows with the corners around it."""
    what, remedy = lack_of_room(np.array([(0, 0), (1, 0), (1, 0.95), (2, 0.95), (2, 1), (0, 1)], dtype=float), 0.05)
    assert "its zones have the outline (0, 0) (1, 0) (1, 0.95) (2, 0.95) (2, 1) (0, 1)" in what
    assert "without tips" in remedy
    many = np.array([(k / 100, 0.001 * (k % 2)) for k in range(100)] + [(0.99, 1.0), (0.0, 1.0)])
    assert corners_as_text(many).endswith(".. (102 corners)")
    assert corners_as_text(np.array([(0, 0), (1, 0), (2, 0), (2, 1), (0, 1)])) == "(0, 0) (2, 0) (2, 1) (0, 1)"
