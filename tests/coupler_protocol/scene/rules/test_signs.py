"""Initial stress in tension, at the wrong height, or k0 in percent is doubted."""

import pytest

from coupler_protocol.scene.reader import build_scene
from coupler_protocol.scene.rules.between_tables import doubts
from tests.small_grounds import REST, TABLES


def said(**stress):
    scene = build_scene(TABLES | {"stage": [REST], "initial_stress": stress})
    return [f"{what}; {remedy}" for path, what, remedy in doubts(scene) if path[0] == "initial_stress"]


@pytest.mark.parametrize(
    ("stress", "what", "remedy"),
    [
        ({"xx": 1e5, "yy": 1e5}, "xx is 100e3 Pa: tension", "did you mean xx = -100e3?"),
        ({"gradient": {"yy": 19620.0}, "level": 4.0}, "yy is 78.48e3 Pa at y = 0 m: tension", "sign of the gradient"),
        ({"gradient": {"yy": -19620.0}}, "yy is 78.48e3 Pa at y = 4 m: tension", "did you mean level = 4?"),
        ({"k0": 50.0}, "k0 is 50", "did you mean 0.5 (50 %)?"),
    ],
)
def test_what_no_ground_begins_with_is_doubted(stress, what, remedy):
    (found,) = said(**stress)
    assert what in found
    assert remedy in found


@pytest.mark.parametrize(
    "stress",
    [{"xx": -1e5, "yy": -2e5}, {"gradient": {"yy": -19620.0, "xx": -9810.0}, "level": 4.0}, {"k0": 0.5}, {"xy": 1e4, "yy": -1e5}],
)
def test_compression_is_not(stress):
    assert said(**stress) == []
