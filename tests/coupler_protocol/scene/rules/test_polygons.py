"""Polygons of regions, windows and excavations are outlines of areas."""

import pytest

from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import build_scene

MATERIAL = {"density": 2000.0, "elastic": {"bulk": 5e7, "shear": 2e7}}
BOWTIE = [[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 2.0]]
LINE = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]
TOUCHING = [[0.0, 0.0], [1.0, 0.0], [0.5, 0.5], [1.0, 1.0], [0.0, 1.0], [0.5, 0.5]]


def box(**more):
    return {
        "format": 1,
        "seed": 1,
        "grid": {"kind": "box", "length": 2.0, "height": 2.0, "zone_size": 0.25},
        "material": [MATERIAL | {"name": "m"}],
        "boundary": [{"on": "bottom", "fix": "xy"}, {"on": "left", "fix": "x"}],
        "damping": {"local": 0.8},
        "stage": [{"name": "rest", "kind": "equilibrium", "gravity": 9.81, "until": {"ratio": 1e-5, "steps": 2000}}],
    } | more


def with_region(polygon):
    return box(material=[MATERIAL | {"name": "m"}, MATERIAL | {"name": "soft", "region": polygon}])


def with_excavation(polygon):
    stages = box()["stage"]
    return box(stage=[*stages, {"name": "dig", "kind": "excavate", "excavate": {"polygon": polygon}, "until": {"steps": 10}}])


@pytest.mark.parametrize(("make", "key"), [(with_region, "material[1].region"), (with_excavation, "stage[1].excavate.polygon")])
@pytest.mark.parametrize(
    ("polygon", "fault"),
    [(BOWTIE, "crosses or touches itself at (1, 1)"), (LINE, "no area"), (TOUCHING, "touches itself at (0.5, 0.5)")],
)
def test_a_polygon_that_is_no_outline_is_refused_by_its_name(make, key, polygon, fault):
    with pytest.raises(SceneError) as found:
        build_scene(make(polygon))
    (problem,) = found.value.problems
    assert problem.key == key
    assert fault in problem.reason
    assert "in order" in problem.remedy


def test_polygons_in_either_direction_are_outlines():
    square = [[0.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]]
    for polygon in (square, square[::-1]):
        build_scene(with_region(polygon))
        build_scene(with_excavation(polygon))
