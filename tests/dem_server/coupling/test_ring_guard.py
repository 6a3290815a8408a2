"""The guard of the ring: which discs are outside, how far gaps have opened, and what ends a run."""

import numpy as np
import pytest
import shapely

from dem_server.coupling.ring_guard import RingGuard, lost_discs, opening, outside, ring_gaps
from dem_server.step.neighbours import rebuild
from tests.dem_server.window_case import ANGLE, OBLIQUE, packed, soil_discs


@pytest.fixture
def window():
    """An L with discs of 0.06 m."""
    return packed(ANGLE, soil_discs(0.06))


@pytest.mark.parametrize("seed", range(5))
def test_what_is_outside_agrees_with_shapely(seed):
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, 60))
    polygon = rng.uniform(0.3, 1.0, 60)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    disc = np.zeros((3000, 8))
    disc[:, :2] = rng.uniform(-1.2, 1.2, (3000, 2))
    expected = ~shapely.contains_xy(shapely.Polygon(polygon), disc[100:, :2])
    assert 0.2 < expected.mean() < 0.9
    np.testing.assert_array_equal(outside(polygon, disc, 100), expected)


def test_a_ring_on_level_and_upright_sides_holds_its_discs():
    model, state = packed(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]), soil_discs(0.06))
    assert not outside(state.x[: model.ring].copy(), state.disc, model.ring).any()
    assert len(lost_discs(model, state)) == 0


@pytest.mark.parametrize("place", [(0.5, 0.0), (0.75, 1.1), (1.5, 0.3)], ids=["bottom", "notch", "right"])
def test_a_disc_is_lost_when_its_centre_is_farther_outside_than_its_radius(window, place):
    model, state = window
    away = {(0.5, 0.0): (0.0, -1.0), (0.75, 1.1): (1.0, 0.0), (1.5, 0.3): (1.0, 0.0)}[place]
    disc = model.ring + 7
    for share, lost in ((0.99, []), (1.01, [disc])):
        state.x[disc] = np.array(place) + share * state.radius[disc] * np.array(away)
        assert lost_discs(model, state).tolist() == lost


def test_the_guard_says_which_disc_is_lost_and_how_far_the_ring_has_opened(window):
    model, state = window
    guard = RingGuard(model, state)
    assert guard.check(model, state) == ""
    disc = model.ring + 3
    state.x[disc] = 0.75 + 3.0 * state.radius[disc], 1.2
    assert guard.check(model, state) == ""  # it cannot have got there: the list of contacts is the old one
    rebuild(model, state)
    with pytest.raises(ArithmeticError, match=rf"1 disc has left the ring: disc {disc} .* at \(0\.\d+, 1\.2\), beyond"):
        guard.check(model, state)


@pytest.mark.parametrize("corners", [ANGLE, OBLIQUE], ids=["L", "oblique"])
def test_gaps_of_a_stretched_ring(corners):
    """They are what centres are apart beyond the radii; the warning comes once a stage, above one smallest radius."""
    model, state = packed(corners, soil_discs(0.06))
    R = model.ring
    guard, begin, radius = RingGuard(model, state), state.x[:R].copy(), state.radius[:R]
    closed = ring_gaps(model, state)
    assert closed.max() < 0.2 * guard.smallest
    for stretch, warns in ((1.2, False), (1.5, True), (1.6, False)):
        state.x[:R] = stretch * begin
        length = np.hypot(*(np.roll(begin, -1, axis=0) - begin).T)
        np.testing.assert_allclose(ring_gaps(model, state), stretch * length - radius - np.roll(radius, -1), atol=1e-12)
        said = guard.check(model, state)
        assert bool(said) is warns
        assert guard.warned is (stretch >= 1.5)
    gaps = ring_gaps(model, state)
    opened = opening(model, state, gaps, gaps.argmax())
    assert opened.width == gaps.max() > guard.smallest
    expected = {"stage": "overload", "radii": opened.width / guard.smallest, "place": opened.place.tolist()}
    assert guard.report("overload") == expected
    guard.begin()
    assert guard.report("next") is None
