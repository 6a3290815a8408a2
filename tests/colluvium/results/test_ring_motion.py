"""Opening and slip along a ring, for motions in closed form."""

from types import SimpleNamespace

import numpy as np
import pytest

from colluvium.results.ring_motion import ring_motion

ON_RING, R = 40, 0.05
ANGLE = 2.0 * np.pi * np.arange(ON_RING) / ON_RING
OUT = np.column_stack([2.0 * np.cos(ANGLE), np.sin(ANGLE)])
NORMAL = np.column_stack([np.cos(ANGLE), 2.0 * np.sin(ANGLE)]) / np.hypot(np.cos(ANGLE), 2.0 * np.sin(ANGLE))[:, None]  # outwards
INSIDE = OUT - 2.0 * R * NORMAL  # a free disc before each control disc of an ellipse
ENDS = np.column_stack([np.arange(ON_RING), np.arange(ON_RING, 2 * ON_RING)])


def frame(ring, inside, ends=ENDS, order=None):
    """Discs and contacts of a frame; order: of the discs in the file."""
    xy, number = np.concatenate([ring, inside]), np.arange(2 * ON_RING)
    order = number if order is None else order
    where = np.argsort(order)
    return SimpleNamespace(xy=xy[order], id=order, control=(order < ON_RING).astype(int)), SimpleNamespace(ends=where[ends])


def rigid(xy, angle=0.7):
    c, s = np.cos(angle), np.sin(angle)
    return xy @ [[c, s], [-s, c]] + [3.0, -1.0]


def test_rigid_motion_of_window_and_rim_neither_opens_nor_slips():
    found = ring_motion(frame(OUT, INSIDE), frame(rigid(OUT), rigid(INSIDE)))
    assert np.abs([found.opening, found.slip]).max() < 1e-14
    assert not found.parted.any()


def test_discs_that_move_inwards_open_and_discs_that_turn_with_the_window_slip():
    along = np.column_stack([-NORMAL[:, 1], NORMAL[:, 0]])
    inside = INSIDE - 0.01 * NORMAL + 1e-5 * along
    found = ring_motion(frame(OUT, INSIDE), frame(rigid(OUT), rigid(inside)))
    np.testing.assert_allclose(found.opening, 0.01, rtol=1e-6)
    np.testing.assert_allclose(found.slip, -1e-5, rtol=1e-3)  # ahead of the rim inside is clockwise round the control disc


def test_order_of_discs_and_of_ends_does_not_matter_and_lost_contacts_are_named():
    order = np.random.default_rng(1).permutation(2 * ON_RING)
    gone = np.delete(ENDS, 7, axis=0)[:, ::-1]
    found = ring_motion(frame(OUT, INSIDE), frame(OUT, 0.9 * INSIDE, gone, order))
    again = ring_motion(frame(OUT, INSIDE), frame(OUT, 0.9 * INSIDE))
    assert np.flatnonzero(found.parted).tolist() == [7]
    for name in ("control", "free", "opening", "slip"):
        np.testing.assert_array_equal(getattr(found, name), getattr(again, name))


def test_contacts_between_free_discs_are_not_of_the_ring():
    ends = np.vstack([ENDS, [[ON_RING, ON_RING + 1]]])
    found = ring_motion(frame(OUT, INSIDE, ends), frame(OUT, INSIDE))
    assert len(found.control) == ON_RING
    assert found.free == pytest.approx(found.control + ON_RING)
