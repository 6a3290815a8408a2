"""Boundaries and initial stress in a scene: what a table may say, and what other tables must say then."""

import copy

import pytest

from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import build_scene
from coupler_protocol.scene.tables.boundary import Boundary

GOOD = {
    "format": 1,
    "seed": 1,
    "grid": {"kind": "box", "length": 4.0, "height": 2.0, "zone_size": 0.5},
    "material": [{"name": "soil", "density": 2000.0, "elastic": {"bulk": 1e8, "shear": 1e8}}],
    "boundary": [{"on": "bottom", "fix": "xy"}, {"on": "left", "fix": "x"}],
    "stage": [
        {"name": "rest", "kind": "equilibrium", "gravity": 9.81, "until": {"ratio": 1e-5, "steps": 100}},
        {"name": "press", "kind": "load", "until": {"steps": 100}, "boundary": [{"on": "top", "velocity": {"y": -1e-6}}]},
    ],
    "initial_stress": {"k0": 0.5},
}


def changed(**tables):
    data = copy.deepcopy(GOOD)
    for path, value in tables.items():
        place, (*way, key) = data, [int(p) if p.isdigit() else p for p in path.split("__")]
        for part in way:
            place = place[part]
        place[key] = value
    return data


def test_the_scene_is_right_and_reads_back_what_it_resolved_to():
    scene = build_scene(GOOD)
    assert build_scene(scene.resolved()) == scene
    assert Boundary(on="top", x=(0, 1), pressure=1.0).place == Boundary(on="top", x=(0, 1), shear=2.0, over=5).place
    assert Boundary(on="top", x=(0, 1), pressure=1.0).place != Boundary(on="top", pressure=1.0).place


RING = {"kind": "ring", "inner": 1.0, "outer": 4.0, "around": 24}


@pytest.mark.parametrize(
    ("table", "key", "words"),
    [
        (
            {"boundary__1": {"on": "left"}},
            "boundary[1]",
            "give one of fix, free, velocity, quiet, shaking, stress, or pressure and shear",
        ),
        ({"boundary__1": {"on": "left", "fix": "x", "pressure": 1.0}}, "boundary[1]", "not fix and pressure"),
        ({"boundary__1": {"on": "left", "velocity": {}}}, "boundary[1].velocity", "give x, y, or both"),
        ({"boundary__1": {"on": "left", "fix": "x", "y": [2, 1]}}, "boundary[1].y", "first < last"),
        ({"boundary__1": {"on": "left", "fix": "x", "name": "a/b"}}, "boundary[1].name", "but no ./."),
        ({"boundary__1": {"on": "inner", "fix": "x"}}, "boundary[1]", "no side 'inner': use one of left, right, bottom, top"),
        ({"boundary__1": {"on": "left", "fix": "x", "y": [5, 6]}}, "boundary[1]", "the left has 5 gridpoints, from x = 0 to 0"),
        ({"boundary__1": {"on": "top", "pressure": 1.0, "x": [5, 6]}}, "boundary[1]", "from x = 0 to 4"),
        ({"boundary__1": {"on": "face", "fix": "x"}}, "boundary[1]", "the grid has no face"),
        ({"stage__1__boundary": [{"on": "outer", "fix": "x"}]}, "stage[1].boundary[0]", "no side 'outer'"),
        ({"stage__1__boundary": [{"on": "top", "pressure": 1.0, "over": 500}]}, "stage[1].boundary[0].over", "at most 100"),
        ({"boundary__1": {"on": "top", "pressure": 1.0, "over": 500}}, "boundary[1].over", "'rest' ends after 100 steps"),
        (
            {"stage__1__kind": "fill"},
            "stage[1].boundary",
            "cannot change in a stage of kind 'fill'.*of kind equilibrium, locate, couple, overload, excavate, surcharge",
        ),
        ({"boundary__1": {"on": "left", "quiet": True}}, "stage[0]", 'would move without end.*time = "real"'),
        ({"stage__0__gravity": None}, "initial_stress.k0", "add gravity = 9.81"),
        ({"initial_stress": {}}, "initial_stress", "give stresses, a gradient, or k0"),
        ({"initial_stress": {"k0": 1.0, "gradient": {"yy": -2e4}}}, "initial_stress", "not both"),
        ({"grid": RING}, "boundary[0]", "no side 'bottom': use one of inner, outer"),
        ({"material__0__region": [[0, 0], [1, 0], [1, 1]], "material__0__top": [[0, 1]]}, "material[0]", "a region and a top"),
    ],
)
def test_mistakes_are_named_with_their_remedy(table, key, words):
    with pytest.raises(SceneError, match=rf"(?s){words}") as found:
        build_scene(changed(**table))
    assert key in {problem.key for problem in found.value.problems}, [str(p) for p in found.value.problems]


def test_a_ring_has_no_ground_for_a_surcharge():
    data = changed(grid=RING, boundary=[], initial_stress={"xx": -1e5})
    data["stage"][1] = {"name": "s", "kind": "surcharge", "surcharge": {"x": [0, 1], "pressure": 1.0}, "until": {"steps": 5}}
    with pytest.raises(SceneError, match="pressure on inner or outer"):
        build_scene(data)
