"""A column under its own weight between smooth walls.

sigma_yy = -rho g (H - y)        sigma_xx = K0 sigma_yy,    K0 = nu/(1 - nu)
"""

import numpy as np
import pytest
from zone_cases import DENSITY, GRAVITY, PAPER, box, settle, sides, soil

from fdm_server.mesh.grid import build_grid
from fdm_server.model import build_model, new_state
from fdm_server.observe import fields

HEIGHT, WIDTH = 12.0, 2.0


@pytest.fixture(scope="module")
def column():
    scene = box(WIDTH, HEIGHT, 0.5, soil(), boundary=sides(left="x", right="x", bottom="y"))
    model = build_model(scene, build_grid(scene))
    state = new_state(model)
    settle(model, state, GRAVITY, 1e-9)
    return model, state


def test_base_carries_the_weight(column):
    model, state = column
    base = model.grid.xy[:, 1] == 0.0
    reaction = model.weight_mass[base] * GRAVITY - state.force[base, 1]
    assert reaction.sum() / WIDTH == pytest.approx(317.844e3, rel=1e-6)


def test_lateral_stress_is_k0_of_the_vertical(column):
    model, state = column
    stress = fields.stress(model, state)
    depth = HEIGHT - model.grid.xy[model.zones, 1].mean(axis=1)
    np.testing.assert_allclose(stress[:, 1], -DENSITY * GRAVITY * depth, rtol=1e-5)
    np.testing.assert_allclose(stress[:, 0], stress[:, 2], rtol=1e-6)
    slope = np.polyfit(depth, stress[:, 0], 1)
    assert np.polyval(slope, HEIGHT) == pytest.approx(-181.625e3, rel=1e-5)
    np.testing.assert_allclose(stress[:, 3], 0.0, atol=1e-5 * 317e3)


def test_settlement(column):
    model, state = column
    top = model.grid.xy[:, 1] == HEIGHT
    modulus = PAPER.bulk + 4 * PAPER.shear / 3
    exact = DENSITY * GRAVITY * HEIGHT**2 / (2 * modulus)
    assert exact == pytest.approx(2.72438e-3, rel=2e-6)
    np.testing.assert_allclose(-state.displacement[top, 1], exact, rtol=1e-5)
