"""The paper's window, 45 % of it stones, is brought to any stress inside its strength: 5 % in circles, 4 % on its sides."""

import numpy as np
import pytest
from insitu_study import DENSITY, FIELDS, GRAVITY, case, window

from coupler_protocol.scene.reader import read_scene
from dem_server.insitu.packing_strength import ROLLING, inside_cone
from dem_server.insitu.zone_stress import imbalance


@pytest.fixture(scope="module")
def scene(configs):
    return read_scene(configs / "paper_slope.toml")


@pytest.mark.parametrize("name", ["K0 .571", "turned 30", "sheared"])
def test_fields_of_the_study_are_what_they_claim(scene, name):
    """In equilibrium with the weight, and inside the cone of friction of Table 2 (mu = .55) everywhere in the window."""
    nodes = window(scene)

    def field(points):
        return np.column_stack(FIELDS[name](*points.T))

    area = np.prod(np.ptp(nodes, axis=0))
    np.testing.assert_allclose(imbalance(nodes, field, DENSITY * GRAVITY * area), 0.0, atol=1e-12)
    stress = field(nodes)
    assert inside_cone(stress, ROLLING * np.sin(np.arctan(0.55)))[1] == 0.0
    if name == "turned 30":
        half, shear = 0.5 * (stress[:, 0] - stress[:, 1]), stress[:, 2]
        np.testing.assert_allclose(np.degrees(0.5 * np.arctan2(shear, half)), 30.0)


@pytest.mark.parametrize("name", ["K0 .571", "turned 30", "sheared"])
def test_stress_sides_and_bonds(scene, name):
    found = case(scene, FIELDS[name], stony=True, seed=0)
    assert max(found["before"]) <= 0.05  # soft discs, all contacts seen
    assert max(found["after"]) <= 0.05  # stones rigid
    assert found["side"] <= 0.04
    assert found["broken"] == 0
    assert found["ratio"] <= 1e-6
    assert found["ratio_later"] <= 1e-5  # bonded, and left for 300 steps
    assert found["projected"] == found["beyond_friction"] == 0.0
    np.testing.assert_allclose(found["imbalance"], 0.0, atol=1e-6)
