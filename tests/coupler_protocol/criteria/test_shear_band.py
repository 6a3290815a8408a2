"""The rule of the band on a small slope whose strain is written down zone by zone, without any run."""

import numpy as np
import pytest
import scipy

from coupler_protocol.criteria import shear_band, shear_band_states

COLUMNS, ROWS = 9, 6


def slope():
    """Gridpoints (N, 2) and zones (Z, 4) of unit zones under a stair: two rows at the toe, six at the crest from column 5 on."""
    x, y = np.meshgrid(np.arange(COLUMNS + 1.0), np.arange(ROWS + 1.0))
    first = np.array([j * (COLUMNS + 1) + i for j in range(ROWS) for i in range(COLUMNS) if j < 2 or i >= 5])
    zones = np.column_stack((first, first + 1, first + COLUMNS + 2, first + COLUMNS + 1))
    return np.column_stack((x.ravel(), y.ravel())), zones


def cells(strained, window=None):
    """Cells whose strain is 0 but in {(column, row): strain}; window: {(column, row): strain} of a window's bins, or None."""
    xy, zones = slope()
    at = [tuple(place) for place in np.floor(shear_band.middles(xy, zones)).astype(int).tolist()]
    inside = window or {}
    keep = np.array([place not in inside for place in at])
    strain = np.array([strained.get(place, 0.0) for place in at])
    windows = [(1, np.array(list(inside)) + 0.5, np.array(list(inside.values())))] if inside else []
    return shear_band.cells(xy, zones[keep], strain[keep], windows)


SURFACE = shear_band.ground(*slope())
BELOW = {(3, 1): 0.03, (4, 1): 0.03}
ABOVE = {(7, 4): 0.02, (8, 5): 0.03}
WAY = {(5, 2): 0.05, (6, 3): 0.04}


def test_toe_and_crest():
    assert sorted(map(tuple, SURFACE.toe)) == [(i + 0.5, 1.5) for i in range(5)]
    assert sorted(map(tuple, SURFACE.crest)) == [(i + 0.5, 5.5) for i in range(5, 9)]


def test_a_triangle_has_its_middle_where_its_area_has():
    xy = np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 3.0]])
    np.testing.assert_allclose(shear_band.middles(xy, np.array([[0, 1, 2, 2]])), [[1.0, 1.0]], rtol=1e-15)


def test_the_level_is_the_weakest_cell_of_the_strongest_connection():
    found = cells(BELOW | WAY | ABOVE)
    assert shear_band.toe_to_crest(found, SURFACE) == 0.02
    assert shear_band.toe_to_crest(found, SURFACE, found.strain == 0.05) == 0.0


@pytest.mark.parametrize(("weakest", "complete"), [(0.0099, False), (0.01, True)])
def test_a_grid_alone_is_complete_from_one_percent_on(weakest, complete):
    found = cells(BELOW | WAY | ABOVE | {(7, 4): weakest})
    assert shear_band_states.holds("complete", found, SURFACE) is complete
    assert not shear_band_states.holds("enters", found, SURFACE)


QUIET = {(5, 3): 0.001, (6, 2): 0.001, (5, 4): 0.001}


@pytest.mark.parametrize(
    ("outside", "inside", "states"),
    [
        ({}, WAY, ()),
        (BELOW, {(5, 2): 0.005, (6, 3): 0.04}, ()),
        (BELOW, {(5, 2): 0.05, (6, 3): 0.001}, ("enters",)),
        (BELOW | {(7, 4): 0.02}, WAY, ("enters", "through")),
        (BELOW | ABOVE, WAY, ("enters", "through", "complete")),
    ],
)
def test_states_beside_a_window(outside, inside, states):
    found = cells(outside, QUIET | inside)
    assert tuple(s for s in ("enters", "through", "complete") if shear_band_states.holds(s, found, SURFACE)) == states


def test_a_band_leaves_an_l_through_its_notch():
    """Zones in the notch lie beyond the window, though within the box around it."""
    l_shape = {(5, 1): 0.05, (6, 1): 0.04, (7, 1): 0.001, (5, 2): 0.001, (5, 3): 0.001}
    found = cells(BELOW | {(6, 2): 0.03, (7, 3): 0.03} | ABOVE, l_shape)
    assert all(shear_band_states.holds(state, found, SURFACE) for state in ("enters", "through", "complete"))


def test_a_window_that_shears_everywhere_is_not_entered():
    found = cells(BELOW | ABOVE, dict.fromkeys(QUIET | WAY, 0.05))
    assert shear_band_states.levels(found, SURFACE) == (0.0, 0.0, 0.0)


def bottleneck_by_bisection(strain, pairs, starts, ends):
    """The definition, tried level by level: the highest strain whose cells and stronger ones connect starts with ends."""
    values = np.unique(strain[strain >= 0.0])
    low, high = -1, len(values)  # values[low] connects, values[high] does not
    while high - low > 1:
        middle = (low + high) // 2
        chosen = strain >= values[middle]
        kept = pairs[chosen[pairs].all(axis=1)]
        graph = scipy.sparse.coo_array((np.ones(len(kept), dtype=bool), kept.T), shape=(len(strain), len(strain)))
        piece = scipy.sparse.csgraph.connected_components(graph, directed=False)[1]
        joined = np.intersect1d(piece[starts[chosen[starts]]], piece[ends[chosen[ends]]]).size
        low, high = (middle, high) if joined else (low, middle)
    return float(values[low]) if low >= 0 else 0.0


@pytest.mark.parametrize("seed", range(4))
def test_the_level_is_that_of_a_bisection(seed):
    """Random strains on a random net, also with equal strains, cells that may not be used, and cells that are start and end."""
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(50):
        count = int(rng.integers(2, 60))
        strain = rng.integers(0, 12, count) / 1000.0 if rng.random() < 0.5 else rng.random(count)
        strain[rng.random(count) < 0.2] = -1.0
        pairs = rng.integers(0, count, (int(rng.integers(0, 3 * count)), 2))
        starts, ends = (np.unique(rng.integers(0, count, int(rng.integers(0, 4)))) for _ in range(2))
        found.append(shear_band.bottleneck(strain, pairs, starts, ends))
        assert found[-1] == bottleneck_by_bisection(strain, pairs, starts, ends)
    assert 0.0 in found
    assert len(set(found)) > 10


def test_cells_without_a_strain_connect_nothing():
    line = np.array([[0, 1], [1, 2]])
    ends = np.array([0]), np.array([2])
    assert shear_band.bottleneck(np.array([0.3, np.nan, 0.4]), line, *ends) == 0.0
    assert shear_band.bottleneck(np.array([0.3, 0.2, 0.4]), line, *ends) == 0.2
