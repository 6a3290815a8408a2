"""What a scene must say of a window drawn as a polygon: every problem with the window's name and what would be right."""

import pytest

from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import build_scene
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
    """An L and a box in its notch: their rims may not meet, not even in one gridpoint."""
    data = uniform(BOX, L_SHAPE)
    for corner, fits in (((3.5, 3.5), True), ((3.0, 3.0), False), ((2.5, 3.0), False)):
        x, y = corner
        second = {"name": "notch", "polygon": [[x, y], [x + 2.5, y], [x + 2.5, y + 2.0], [x, y + 2.0]]}
        both = data | {"window": [data["window"][0], second]}
        if fits:
            assert len(build_scene(both).window) == 2
        else:
            assert "touches window 'hole'" in problems(both)


def test_a_window_may_lie_in_a_ring():
    ring = {"kind": "ring", "inner": 1.0, "outer": 6.0, "around": 24}
    data = uniform(ring, [[1.6, 0.4], [4.0, 0.4], [3.3, 2.6], [1.3, 1.3]])
    data["boundary"] = [{"on": "outer", "fix": "xy"}]
    assert build_scene(data).window[0].polygon is not None
    data["window"][0]["polygon"] = [[-4.0, -4.0], [4.0, -4.0], [4.0, 4.0], [-4.0, 4.0]]
    assert "touches the boundary" in problems(data)
