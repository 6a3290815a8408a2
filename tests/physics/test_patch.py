"""Patch test (Irons & Razzaque 1972): linear displacement of the boundary, constant stress on any mesh."""

from dataclasses import replace

import numpy as np
import pytest
from zone_cases import PAPER, ring, settle, slope, soil

from fdm_server.mesh.grid import build_grid
from fdm_server.mesh.zone_sides import boundary_edges
from fdm_server.model import build_model, new_state
from fdm_server.observe import fields
from fdm_server.step.zone_pass import advance

GRADIENT = np.array([[2e-4, -3e-4], [1e-4, 5e-5]])


PROFILE = ((0, 2), (2, 2), (3.1, 4.3), (4.4, 4.3), (7.3, 5), (9, 5))
SCENES = {
    "net": slope(0.5, soil()),
    "nodal": slope(0.5, soil(), mixed="nodal"),
    "fitted": slope(0.5, soil(), profile=PROFILE, fit="profile"),
    "layered": slope(0.5, soil(), soil(top=[(0, 1), (4, 2), (9, 3)]), profile=PROFILE, fit="profile"),
    "graded": slope(0.3, soil(), profile=PROFILE, fit="profile", graded={"x": (2.0, 5.0), "y": (3.0, 5.0), "ratio": 1.15}),
    "ring": ring(1.0, 5.0, 16, soil()),
    "quarter": ring(1.0, 5.0, 8, soil(), part="quarter", growth=1.2),
}


@pytest.fixture(scope="module", params=SCENES)
def distorted(request):
    """Quads and triangles; inner gridpoints of the net, and with nodal averages, have been shaken by up to 30 % of a zone."""
    scene = SCENES[request.param]
    grid = build_grid(scene)
    outer = np.unique(boundary_edges(grid.zones))
    xy = grid.xy.copy()
    inner = np.setdiff1d(np.arange(len(xy)), outer)
    if request.param in ("net", "nodal"):
        xy[inner] += np.random.default_rng(5).uniform(-0.15, 0.15, (len(inner), 2))
    model = build_model(scene, grid._replace(xy=xy))
    fixed = np.zeros(xy.shape, dtype=np.bool_)
    fixed[outer] = True
    return replace(model, fixed=fixed), outer


def test_linear_displacement_gives_constant_stress(distorted):
    model, outer = distorted
    state = new_state(model)
    target = model.grid.xy @ GRADIENT.T

    state.velocity[outer] = target[outer]  # one step moves the boundary, then it is held
    advance(model, state)
    state.velocity[:] = 0.0
    settle(model, state, 0.0, 1e-14)

    exx, eyy, gamma = GRADIENT[0, 0], GRADIENT[1, 1], GRADIENT[0, 1] + GRADIENT[1, 0]
    K, G = PAPER.bulk, PAPER.shear
    a1, a2 = K + 4 * G / 3, K - 2 * G / 3
    exact = np.array([a1 * exx + a2 * eyy, a2 * exx + a1 * eyy, a2 * (exx + eyy), G * gamma])
    np.testing.assert_allclose(state.displacement, target, atol=1e-10 * np.abs(target).max())
    np.testing.assert_allclose(fields.stress(model, state), np.tile(exact, (len(model.zone), 1)), rtol=1e-10)
    np.testing.assert_allclose(fields.shear_strain(model, state), np.hypot(exx - eyy, gamma), rtol=1e-9)
