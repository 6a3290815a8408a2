"""Strain in bins: exact for uniform gradients, absent where discs are too few, and the same after a message."""

import numpy as np
import pytest

from coupler_protocol.criteria import strain_bins

OUTLINE = np.array([[1.0, 2.0], [3.0, 2.0], [3.0, 5.0], [1.0, 5.0]])


@pytest.fixture
def places():
    return np.random.default_rng(3).uniform((1.0, 2.0), (3.0, 5.0), (600, 2))


def test_bins_fill_the_outline_row_by_row():
    bins = strain_bins.bins_over(OUTLINE, 1.02)
    assert bins.shape == strain_bins.shape_over(OUTLINE, 1.02) == (2, 3)
    np.testing.assert_allclose(bins.middles, [[1.5, 2.5], [2.5, 2.5], [1.5, 3.5], [2.5, 3.5], [1.5, 4.5], [2.5, 4.5]])
    assert bins.area.sum() == pytest.approx(6.0, rel=1e-12)


def test_a_window_smaller_than_a_zone_is_one_bin():
    assert strain_bins.shape_over(OUTLINE, 50.0) == (1, 1)


@pytest.mark.parametrize("angle", [0.0, 0.4, 1.2])
def test_a_uniform_gradient_is_found_exactly_and_turning_changes_nothing(places, angle):
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    gradient = turn @ np.array([[0.01, 0.03], [0.005, -0.02]]) @ turn.T
    bins = strain_bins.bins_over(OUTLINE, 1.0)
    np.testing.assert_allclose(strain_bins.shear(places, places @ gradient.T + 7.0, bins), np.hypot(0.03, 0.035), rtol=1e-9)


def test_rows_of_a_message_leave_out_bins_with_too_few_discs(places):
    bins = strain_bins.bins_over(OUTLINE, 1.0)
    few = places[(bins.of(places) != 2) | (np.arange(len(places)) % 40 == 0)]
    assert 0 < (bins.of(few) == 2).sum() < strain_bins.FEWEST_DISCS
    motion = np.column_stack((0.02 * few[:, 1], 0.0 * few[:, 0]))
    rows = strain_bins.as_rows(few, motion, bins)
    assert rows.shape == (6, 3)
    assert rows[2, 2] == strain_bins.NONE
    middles, strain = strain_bins.from_rows(rows)
    assert np.array_equal(middles, np.delete(bins.middles, 2, axis=0))
    assert np.array_equal(strain, np.delete(strain_bins.shear(few, motion, bins), 2))
