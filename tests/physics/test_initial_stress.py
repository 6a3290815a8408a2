"""Initial stress: at rest under level ground from the first step, whatever lies in layers; the ground above, on slopes."""

import numpy as np
import pytest
from run_cases import SOIL, column, compute, stage
from zone_cases import slope, soil

from fdm_server.ground.initial_stress import overburden
from fdm_server.mesh.grid import build_grid, centroids
from fdm_server.model import build_model

LAYER = SOIL | {"name": "layer", "density": 1500.0, "top": [[0.0, 2.2]]}
LENS = SOIL | {"name": "lens", "density": 2600.0, "region": [[0.0, 3.2], [2.0, 3.2], [2.0, 4.2], [0.0, 4.2]]}
GRADED = {"graded": {"x": [0.0, 2.0], "ratio": 1.1}, "zone_size": 0.4}  # a net that follows the layer's top


@pytest.mark.parametrize(
    ("material", "initial"),
    [
        ([SOIL], {"k0": 0.4}),
        ([SOIL], {"level": 6.0, "gradient": {"xx": -0.4 * 19620.0, "yy": -19620.0, "zz": -0.4 * 19620.0}}),
        ([SOIL, LAYER], {"k0": 0.7}),
        ([SOIL, LENS | {"region": [[0, 3], [2, 3], [2, 5], [0, 5]]}, LAYER | {"top": [[0.0, 2.0]]}], {"k0": 0.7, "xy": 0.0}),
    ],
)
def test_level_ground_begins_at_rest(tmp_path, material, initial):
    even = len(material) != 2
    grid = column() if even else column() | GRADED
    rest = stage("rest", "equilibrium", ratio=1e-12, gravity=9.81)
    with compute(tmp_path, grid, rest, material=material, initial_stress=initial) as run:
        assert run.info["stages"][0]["steps"] < 100
        assert run.history("unbalanced_ratio")[1].max() < 1e-12
        k0 = initial.get("k0", 0.4)
        s = run.zones(-1).stress
        np.testing.assert_allclose(s[:, 0], k0 * s[:, 1], rtol=1e-12)
        np.testing.assert_allclose(s[:, 2], s[:, 0], rtol=1e-12)
        mass = {1: 2000 * 6.0, 2: 2000 * 3.8 + 1500 * 2.2, 3: 2000 * 2 + 2600 * 2 + 1500 * 2}[len(material)]
        assert run.info["stages"][0]["reactions"]["bottom"]["y"] == pytest.approx(2.0 * 9.81 * mass, rel=1e-10)


def test_overburden_on_a_slope_is_the_height_of_the_ground_above():
    scene = slope(0.5, soil(density=1000.0), profile=((0, 2), (2, 2), (4.2, 5), (8, 5)), fit="profile")
    model = build_model(scene, build_grid(scene))
    x, y = centroids(model.grid.xy, model.zones).T
    above = np.interp(x, (0, 2, 4.2, 8), (2, 2, 5, 5)) - y
    np.testing.assert_allclose(overburden(model, scene.material, np.column_stack([x, y])), 1000.0 * above, rtol=1e-9)


def test_stress_beyond_the_strength_is_brought_back(tmp_path):
    clay = SOIL | {"mohr_coulomb": {"friction": 0.0, "cohesion": 10e3}}
    with compute(tmp_path, column(), stage("rest", steps=10), material=[clay], initial_stress={"yy": -50e3}) as run:
        s = run.zones(0).stress
        assert (s[:, 0] - s[:, 1]).max() <= 20e3 * (1 + 1e-9)
