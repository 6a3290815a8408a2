"""The guard of the ring: which discs are outside, how far gaps have opened, and what ends a run."""

import numpy as np
import pytest
import shapely

from coupler_protocol.geometry import polygon_area
from coupler_protocol.interface.ring import build_ring
from dem_server.coupling.ring_guard import RingGuard, lost_discs, opening, outside, ring_gaps, some_outside
from dem_server.model import build_model, outline
from dem_server.observe.coordination import porosity
from dem_server.packing import packing
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


@pytest.fixture
def open_window():
    """A box of discs of 0.06 m whose upper side is the ground surface, a ridge."""
    chain = np.array([[0.0, 1.0], [0.0, 0.5], [0.0, 0.0], [1.0, 0.0], [1.0, 0.5], [1.0, 1.0]])
    ring = build_ring(chain, 0.05, np.array([[0.5, 1.3]]))
    discs = soil_discs(0.06)
    closed = build_ring(ring.outline, 0.05)
    found = packing.pack(ring.outline, closed.xy, closed.radius, discs, np.random.default_rng(1))
    return build_model(ring.xy, ring.radius, found, discs, surface=ring.surface)


@pytest.mark.parametrize(
    ("place", "lost"),
    [((0.5, 1.2), False), ((0.5, 30.0), False), ((0.5, -0.2), True), ((-0.2, 0.5), True), ((1.2, 3.0), True)],
    ids=["on top", "in the air", "below", "left", "beside the window"],
)
def test_a_disc_above_an_open_ring_is_not_lost(open_window, place, lost):
    model, state = open_window
    guard, disc = RingGuard(model, state), model.ring + 3
    assert guard.check(model, state) == ""
    assert guard.widest.width < guard.smallest  # none from the last control disc to the first
    state.x[disc] = place
    assert some_outside(state.disc, model.ring, True) == lost
    assert lost_discs(model, state).tolist() == ([disc] if lost else [])
    rebuild(model, state)
    if lost:
        words = "crossed the ground surface beside the window" if place[1] > 1.0 else "left the ring"
        with pytest.raises(ArithmeticError, match=words):
            guard.check(model, state)
    else:
        assert guard.check(model, state) == ""


def test_the_outline_of_an_open_window_includes_the_ground_surface(open_window):
    model, state = open_window
    assert polygon_area(outline(model, state)) == pytest.approx(1.15)
    assert 0.1 < porosity(model, state) < 0.25
    shares = state.weight[: model.ring] / (model.density[: model.ring] * np.pi * state.radius[: model.ring] ** 2)
    slope = np.degrees(np.arctan2(0.3, 0.5))
    np.testing.assert_allclose(shares[[0, -1]], (90.0 + slope) / 360.0)
