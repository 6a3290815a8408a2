"""Fitted slopes and graded nets: the ground is where the profile is, zones keep their shape at any angle."""

from math import radians, tan

import numpy as np
import pytest
import shapely
from grid_cases import material, slope, window
from hypothesis import given, settings
from hypothesis import strategies as st

from coupler_protocol.scene.tables.grid import Graded, Grid
from fdm_server.mesh.fitted_net import aspects
from fdm_server.mesh.graded_lines import net_lines
from fdm_server.mesh.grid import areas, build_grid, centroids
from fdm_server.mesh.grid_sides import side_of
from fdm_server.mesh.window_zones import rim_of, window_zones
from fdm_server.mesh.zone_sides import boundary_edges


def fitted(size, profile, materials=None, **kept):
    kept = {"length": profile[-1][0], "height": max(y for _, y in profile)} | kept
    return build_grid(slope(size, profile, materials, fit="profile", **kept))


def face(angle, height=10.0, bench=0.0, foot=4.1):
    """A slope at an angle [deg] from toe (6.2, foot), with a bench at half height; 12 m of crest."""
    run = 0.0 if angle == 90 else height / tan(radians(angle))
    points = [(0.0, foot), (6.2, foot), (6.2 + run / 2, foot + height / 2)]
    points += [(6.2 + run / 2 + bench, foot + height / 2)] if bench else []
    return [*points, (6.2 + run + bench, foot + height), (18.2 + run + bench, foot + height)]


def mirrored(profile):
    return [(profile[-1][0] - x, y) for x, y in profile[::-1]]


def area_below(profile):
    x, y = np.transpose(profile)
    return np.trapezoid(y, x)


@pytest.mark.parametrize("angle", [5, 12, 26.565, 34, 45, 57, 63.435, 71, 80, 86, 90])
@pytest.mark.parametrize("bench", [0.0, 2.3])
@pytest.mark.parametrize("size", [1.0, 0.37])
def test_faces_at_any_angle(angle, bench, size):
    for profile in (face(angle, bench=bench), mirrored(face(angle, bench=bench))):
        grid = fitted(size, profile)
        area = areas(grid.xy, grid.zones)
        assert area.min() > 0.1 * size**2
        assert area.sum() == pytest.approx(area_below(profile), rel=1e-12)
        assert aspects(grid.xy, grid.zones).max() < 2.5
        assert np.array_equal(np.unique(grid.zones), np.arange(len(grid.xy)))
        for point in profile:  # every break is a gridpoint
            assert np.hypot(*(grid.xy - point).T).min() < 1e-9
        near = boundary_edges(grid.zones)
        assert np.hypot(*(grid.xy[near[:, 0]] - grid.xy[near[:, 1]]).T).max() < 2.5 * size
        assert len(side_of(grid, "face")) > 2


rises = st.floats(-4.0, 4.0)
runs = st.floats(1.0, 8.0)


@settings(max_examples=150, deadline=None)
@given(parts=st.lists(st.tuples(runs, rises), min_size=1, max_size=6), size=st.sampled_from([0.25, 0.4, 0.5]))
def test_any_profile_gives_good_zones_or_a_refusal(parts, size):
    x, y = np.cumsum([(0.0, 6.0), *parts], axis=0).T
    profile = list(zip(x, np.maximum(y, 2.0), strict=True))
    grid = fitted(size, profile)
    assert areas(grid.xy, grid.zones).min() > 0
    assert areas(grid.xy, grid.zones).sum() == pytest.approx(area_below(profile), rel=1e-10)
    assert aspects(grid.xy, grid.zones).max() < 4.0


def test_gridpoints_three_sides_below_the_face_do_not_move():
    grid = fitted(0.5, face(34))
    x = np.unique(np.round(grid.xy[grid.xy[:, 1] < 2.0, 0], 9))
    deep = grid.xy[grid.xy[:, 1] < 2.0]
    assert len(deep) == len(x) * len(np.unique(np.round(deep[:, 1], 9)))


def test_windows_are_rectangles_below_the_fitted_surface():
    grid = fitted(0.5, face(34))
    inside = window_zones(grid, window((20, 24), (3, 7)))
    assert inside.sum() == 25
    assert len(rim_of(grid, inside)) == 20
    high = grid.row[(grid.column == 20)].max()
    with pytest.raises(ValueError, match=r"no rectangles|beyond the ground surface"):
        window_zones(grid, window((20, 22), (high - 2, high)))


def test_zones_follow_tops():
    layer, dipping = material("clay"), material("rock")
    layer.top, dipping.top = [(0.0, 3.3)], [(0.0, 1.0), (30.0, 2.0)]
    grid = fitted(0.5, face(34), [material(), layer, dipping])
    x, y = centroids(grid.xy, grid.zones).T
    assert np.array_equal(grid.material, np.where(y < 1 + x / 30, 2, np.where(y < 3.3, 1, 0)))
    area, length = areas(grid.xy, grid.zones), grid.xy[:, 0].max()
    assert area[grid.material > 0].sum() == pytest.approx(3.3 * length, rel=1e-12)
    assert area[grid.material == 2].sum() == pytest.approx(45.0 + 2.0 * (length - 30.0), rel=1e-12)


LINES = {
    "dipping": [(0.0, 2.0), (20.0, 3.0), (34.0, 6.0)],
    "with the slope": [(0.0, 2.0), (10.0, 4.0), (20.0, 11.0), (34.0, 12.0)],
    "out of the face": [(0.0, 12.0), (34.0, 2.0)],
    "buried ridge": [(0.0, 1.0), (12.0, 9.0), (15.0, 2.0), (34.0, 3.0)],
    "through the bottom": [(2.0, 4.0), (14.0, -3.0), (30.0, -1.0), (34.0, 3.0)],
}


@pytest.mark.parametrize("line", LINES)
@pytest.mark.parametrize("angle", [20, 40, 75])
def test_sloping_lines_are_followed_into_the_open(line, angle):
    profile = face(angle, height=8.0, bench=2.3)
    layer = material("rock")
    layer.top = LINES[line]
    grid = fitted(0.5, profile, [material(), layer])
    length = profile[-1][0]
    ground = shapely.Polygon([*profile, (length, 0.0), (0.0, 0.0)])
    ends = (-1.0, layer.top[0][1]), (length + 50.0, layer.top[-1][1])
    rock = shapely.Polygon([ends[0], *layer.top, ends[1], (length + 50.0, -9.0), (-1.0, -9.0)]).intersection(ground)
    area = areas(grid.xy, grid.zones)
    assert area.min() > 0
    assert area.sum() == pytest.approx(ground.area, rel=1e-12)
    assert area[grid.material == 1].sum() == pytest.approx(rock.area, abs=0.003 * ground.area)  # less exact at tips in the open
    assert aspects(grid.xy, grid.zones).max() < 4.0


def test_a_line_that_would_spoil_zones_is_left_to_their_centres():
    layer, close = material("clay"), material("rock")
    layer.top, close.top = [(0.0, 2.0), (34.0, 3.0)], [(0.0, 2.2), (34.0, 2.8)]  # they cross at a small angle
    grid = fitted(0.5, face(34), [material(), layer, close])
    assert aspects(grid.xy, grid.zones).max() < 4.0
    x, y = centroids(grid.xy, grid.zones).T
    assert np.array_equal(grid.material == 2, y < np.interp(x, (0, 34), (2.2, 2.8)))
    assert areas(grid.xy, grid.zones).sum() == pytest.approx(area_below(face(34)), rel=1e-12)


def test_graded_zones_grow_in_steps_of_the_ratio():
    lines = net_lines(40.0, 0.5, [], (10.0, 15.0), 1.1)
    sizes = np.diff(lines)
    inside = (lines[1:] > 10.0 + 1e-9) & (lines[1:] <= 15.0 + 1e-9)
    np.testing.assert_allclose(sizes[inside], 0.5, rtol=1e-9)
    steps = sizes[1:] / sizes[:-1]
    assert np.all((np.abs(steps - 1.1) < 0.02) | (np.abs(steps - 1 / 1.1) < 0.02) | (np.abs(steps - 1) < 0.06))
    assert (lines[0], lines[-1]) == (0.0, 40.0)


def test_a_graded_box():
    table = {"kind": "box", "length": 20.0, "height": 10.0, "zone_size": 0.25, "profile": None}
    graded = {"x": (0.0, 4.0), "y": (7.0, 10.0), "ratio": 1.1}
    scene = slope()
    scene.grid = Grid(**table, graded=graded)
    grid = build_grid(scene)
    assert areas(grid.xy, grid.zones).sum() == pytest.approx(200.0, rel=1e-12)
    assert aspects(grid.xy, grid.zones).max() < 4.0
    assert len(grid.zones) < 3200 / 2.5
    fine = (grid.xy[:, 0] < 4.01) & (grid.xy[:, 1] > 6.99)
    assert fine.sum() == 17 * 13


@pytest.mark.parametrize(
    ("profile", "words"),
    [
        ([(0, 4), (8, 12), (19, 12)], "must run from x = 0"),
        ([(0, 4), (8, 12), (6, 12), (20, 12)], "overhangs"),
        ([(0, 0.5), (12, 12), (20, 12)], "at least|between one zone"),
        ([(0, 4), (8, 4), (8.2, 4.1), (20, 4)], "closer than half a zone"),
        ([(0, 4), (8, 4), (8.1, 12), (8.2, 4), (20, 4)], "narrower than a zone"),
    ],
)
def test_what_cannot_be_fitted_is_refused(profile, words):
    with pytest.raises(ValueError, match=words):
        fitted(1.0, profile, length=20.0, height=12.0)


def test_zones_that_grow_too_flat_are_refused_for_their_ratio():
    """Growing by 1.5 in x alone, zones 1 m high get wider than 7.9 m, by 1.2 they do not."""
    level = [(0, 4), (200, 4)]
    with pytest.raises(ValueError, match=r"like a rectangle of [\d.]+ to 1 \(at most 7\.9 to 1\): use a smaller graded\.ratio"):
        fitted(1.0, level, length=200.0, height=4.0, graded=Graded(x=(0.0, 10.0), ratio=1.5))
    fitted(1.0, [(0, 4), (40, 4)], graded=Graded(x=(0.0, 10.0), ratio=1.2))


@pytest.mark.parametrize("fit", ["profile", "face", "diagonals"])
@pytest.mark.parametrize(
    ("profile", "words"),
    [
        ([(0, 0), (8, 0), (12, 4), (20, 4)], r"for rock at the level of the toe, draw a row of rock \(add 1 m"),
        (
            [(412345, 4), (412353, 4), (412361, 12), (412365, 12)],
            r"use origin = \[412345, 0\] and length = 20",
        ),
        ([(0, 4), (8, 4), (16, 12), (24, 12)], "use length = 24"),
        ([(0, 4), (8, 4), (18, 14), (20, 14)], "use height = 14"),
    ],
)
def test_a_profile_that_misses_the_grid_is_refused_with_what_would_fit(fit, profile, words):
    with pytest.raises(ValueError, match=words):
        build_grid(slope(1.0, profile, length=20.0, height=12.0, fit=fit))
