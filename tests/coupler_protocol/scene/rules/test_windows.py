"""What a scene must say of a window drawn as a polygon: every problem with the window's name and what would be right."""

import tomllib

import pytest

from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import build_scene
from fdm_server.mesh.grid import build_grid
from fdm_server.mesh.window_zones import rim_of, window_zones
from tests.window_scenes import BOX, CIRCLE, L_SHAPE, uniform


def problems(data):
    with pytest.raises(SceneError) as found:
        build_scene(data)
    return " | ".join(map(str, found.value.problems))


def test_an_l_and_a_circle_are_windows():
    for shape in (L_SHAPE, CIRCLE):
        assert build_scene(uniform(BOX, shape)).window[0].polygon[0] == tuple(shape[0])


@pytest.mark.parametrize(
    ("window", "words"),
    [
        ({"columns": [4, 8]}, "a polygon and columns"),
        ({"columns": [4, 8], "rows": [4, 8]}, "a polygon and columns and rows"),
        ({"polygon": [[1.0, 1.0], [4.0, 4.0], [4.0, 1.0], [1.0, 4.0]]}, "crosses or touches itself"),
        ({"polygon": [[1.0, 1.0], [2.0, 1.0], [4.0, 1.0]]}, "has no area"),
        ({"polygon": None}, "does not say which zones it takes"),
        ({"polygon": None, "rows": [3, 7]}, "missing"),
        ({"polygon": [[1.0, 1.0], [8.0, 1.0], [6.0, 4.0]]}, "window 'hole': it touches the boundary of the grid at ("),
        ({"polygon": [[2.0, 2.0], [2.7, 2.0], [2.7, 5.0], [2.0, 5.0]]}, "window 'hole' is 0.5 x 3 m: too small for discs"),
        ({"polygon": [[9.0, 2.0], [9.7, 2.0], [9.7, 5.0]]}, "window 'hole' contains no zones"),
    ],
)
def test_what_is_no_window_is_refused(window, words):
    data = uniform(BOX, L_SHAPE)
    data["window"][0] |= window
    data["window"][0] = {key: value for key, value in data["window"][0].items() if value is not None}
    assert words in problems(data)


def test_a_narrow_arm_is_refused_where_it_is():
    arm = [[1.0, 1.0], [4.0, 1.0], [4.0, 3.5], [6.0, 3.5], [6.0, 4.0], [1.0, 4.0]]
    build_scene(uniform(BOX, arm))
    data = uniform(BOX, arm, radius=0.07)
    assert "window 'hole' is narrower than 4 discs of radius 0.07 m at (6, " in problems(data)


def test_two_polygons_keep_a_zone_between_them():
    """An L and a box in its notch: their rims may not meet, not even in one gridpoint, nor may a third one meet both."""
    data = uniform(BOX, L_SHAPE)
    touches = "window 'notch' touches window 'hole' in 10 gridpoints, at (3, 3)"
    for corner, words in (
        ((3.5, 3.5), ""),
        ((3.0, 3.0), touches),
        ((2.5, 3.0), "overlaps window 'hole' in 4 zones, one at (2.75, 3.25"),
    ):
        x, y = corner
        second = {"name": "notch", "polygon": [[x, y], [x + 2.5, y], [x + 2.5, y + 2.0], [x, y + 2.0]]}
        both = data | {"window": [data["window"][0], second]}
        if not words:
            assert len(build_scene(both).window) == 2
        else:
            assert words in problems(both)


def test_a_window_may_lie_in_a_ring():
    ring = {"kind": "ring", "inner": 1.0, "outer": 6.0, "around": 24}
    data = uniform(ring, [[1.6, 0.4], [4.0, 0.4], [3.3, 2.6], [1.3, 1.3]])
    data["boundary"] = [{"on": "outer", "fix": "xy"}]
    assert build_scene(data).window[0].polygon is not None
    data["window"][0]["polygon"] = [[-4.0, -4.0], [4.0, -4.0], [4.0, 4.0], [-4.0, 4.0]]
    assert "touches the boundary" in problems(data)


def test_windows_that_meet_in_one_gridpoint_are_refused_and_all_pairs_are_told():
    boxes = {"low": (1.0, 1.0), "middle": (2.5, 2.5), "high": (4.0, 4.0)}
    windows = [{"name": n, "polygon": [[x, y], [x + 1.5, y], [x + 1.5, y + 1.5], [x, y + 1.5]]} for n, (x, y) in boxes.items()]
    found = problems(uniform(BOX, L_SHAPE) | {"window": windows})
    assert "window 'middle' touches window 'low' in 1 gridpoint, at (2.5, 2.5)" in found
    assert "window 'high' touches window 'middle' in 1 gridpoint, at (4, 4)" in found


def test_oblique_windows_along_a_face_keep_a_zone_between_them(configs):
    """Parallelograms in columns that run along the face: one zone apart is right, side by side and corner to corner are not."""
    data = tomllib.loads((configs / "quick_notch.toml").read_text(encoding="utf-8"))
    grid = build_grid(build_scene(data))
    blocks = {
        "below": (14, 16, 3, 6),
        "level": (14, 16, 8, 11),
        "side": (17, 19, 3, 6),
        "corner": (17, 19, 7, 10),
        "apart": (18, 20, 3, 6),
    }

    def window(name):
        left, right, low, high = blocks[name]
        inside = (grid.column >= left) & (grid.column <= right) & (grid.row >= low) & (grid.row <= high)
        return {"name": name, "polygon": grid.xy[rim_of(grid, inside)].tolist()}

    for name, words in (
        ("level", ""),
        ("apart", ""),
        ("side", "touches window 'below' in 5 gridpoints"),
        ("corner", "in 1 gridpoint"),
    ):
        both = data | {"window": [window("below"), window(name)]}
        both["discs"] = data["discs"] | {"radius": 0.1}
        if words:
            assert words in problems(both), name
        else:
            rims = [rim_of(grid, window_zones(grid, one)) for one in build_scene(both).window]
            assert not set(rims[0]) & set(rims[1])


# -- windows at the ground surface -----------------------------------------------------------------------------------------


def at_the_surface(**more):
    """A box of ground whose window reaches its top."""
    data = uniform(BOX, [[2.5, 3.5], [5.0, 3.5], [5.0, 6.6], [2.5, 6.6]])
    data["boundary"] = data["boundary"][:3]
    data["stage"][0]["gravity"] = 9.81
    return data | more


def test_a_window_may_reach_the_ground_surface():
    assert len(build_scene(at_the_surface()).window) == 1
    rows = at_the_surface(window=[{"name": "top", "columns": [4, 9], "rows": [7, 12]}])
    assert build_scene(rows).window[0].rows == (7, 12)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"on": "top", "pressure": 1e4}, "boundary[3]: this acts on the ground surface of window 'hole'"),
        ({"on": "top", "fix": "y", "x": [4.0, 6.0]}, "boundary[3]: this acts on the ground surface of window 'hole'"),
        (
            {"on": "top", "pressure": 1e4, "x": [5.0, 7.0]},
            "boundary[3]: this loads a zone at the end of the rim of window 'hole'",
        ),
        ({"on": "top", "pressure": 1e4, "x": [5.5, 7.0]}, ""),
        ({"on": "top", "pressure": 1e4, "x": [0.0, 2.0]}, ""),
    ],
)
def test_nothing_acts_on_the_surface_of_a_window(table, words):
    data = at_the_surface()
    data["boundary"] = [*data["boundary"], table]
    if words:
        assert words in problems(data)
    else:
        build_scene(data)


def test_no_surcharge_acts_on_the_surface_of_a_window():
    data = at_the_surface()
    load = {"name": "load", "kind": "surcharge", "surcharge": {"x": [4.0, 6.0], "pressure": 1e4}, "until": {"steps": 10}}
    data["stage"] = [*data["stage"], load]
    assert "stage[3].surcharge: this acts on the ground surface of window 'hole'" in problems(data)
