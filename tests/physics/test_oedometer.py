"""Oedometer: soil compressed without lateral strain flows along the edge s2 = s3 of its yield surface.

With a1 = K + 4G/3, a2 = K - 2G/3, N, Np and C as in fdm_server/effects/mohr_coulomb.py, both planes that meet
in the edge yield by the same amount. Consistency, d s1 = N d s3, gives strain at yield and slope after it:

    eps_y = C/(a1 - N a2)         ds/d eps = a1 - m1 (a1 - N a2)/(m1 - N m23)
    m1 = a1 - a2 Np               m23 = a2 - (a1 + a2) Np/2
"""

from math import cos, pi, radians, sin, sqrt

import numpy as np
import pytest
from zone_cases import box, soil, stretch

from fdm_server.effects.elastic import Elastic
from fdm_server.effects.mohr_coulomb import MohrCoulomb
from fdm_server.effects.tension import Tension
from fdm_server.mesh.grid import build_grid
from fdm_server.model import build_model, new_state
from fdm_server.observe import fields

SOIL = soil(
    Elastic(bulk=200e6, shear=200e6),
    MohrCoulomb(friction=10, cohesion=1e6, dilation=10),
    Tension(strength=5.67e6),
)
K = G = 200e6
A1, A2 = K + 4 * G / 3, K - 2 * G / 3
N = (1 + sin(radians(10))) / (1 - sin(radians(10)))
C = 2 * 1e6 * sqrt(N)
M1, M23 = A1 - A2 * N, A2 - 0.5 * (A1 + A2) * N
YIELD = C / (A1 - N * A2)


def vertical(strain):
    """Closed form of the vertical stress [Pa], compression positive."""
    if strain <= YIELD:
        return A1 * strain
    return A1 * YIELD + (A1 - M1 * (A1 - N * A2) / (M1 - N * M23)) * (strain - YIELD)


@pytest.fixture(scope="module")
def zone():
    scene = box(1.0, 1.0, 1.0, SOIL)
    return build_model(scene, build_grid(scene))


def test_closed_form_has_the_reference_values():
    assert pytest.approx(6.40760e-3, rel=1e-6) == YIELD
    assert vertical(YIELD) == pytest.approx(2.99021e6, rel=2e-6)
    assert vertical(0.02) == pytest.approx(7.02622e6, rel=1e-6)


@pytest.mark.parametrize("steps", [20, 200, 2000])
def test_stress_follows_the_edge_at_any_step(zone, steps):
    state = new_state(zone)
    stretch(zone, state, [[0, 0], [0, -0.02]], steps)
    xx, yy, zz, xy = fields.stress(zone, state)[0]
    assert -yy == pytest.approx(vertical(0.02), rel=1e-10)
    assert xx == pytest.approx(zz, rel=1e-10)
    assert yy - N * xx + C == pytest.approx(0.0, abs=1e-10 * C)
    assert xy == pytest.approx(0.0, abs=1e-3)
    assert fields.plastic_state(zone, state)[0] & 1


def test_elastic_until_yield(zone):
    state = new_state(zone)
    stretch(zone, state, [[0, 0], [0, -0.999 * YIELD]], 10)
    assert fields.plastic_state(zone, state)[0] == 0
    assert -fields.stress(zone, state)[0, 1] == pytest.approx(A1 * 0.999 * YIELD, rel=1e-12)


@pytest.mark.parametrize("angle", [7.0, 30.0, 45.0, 73.0])
def test_oblique_grid_gives_the_turned_stress(zone, angle):
    """The grid and the strain turned by an angle: the stress turns with them."""
    a = angle * pi / 180
    R = np.array([[cos(a), -sin(a)], [sin(a), cos(a)]])
    scene = box(1.0, 1.0, 1.0, SOIL)
    grid = build_grid(scene)
    turned = build_model(scene, grid._replace(xy=grid.xy @ R.T))
    straight, oblique = new_state(zone), new_state(turned)
    gradient = np.array([[0.004, 0.006], [0.0, -0.02]])
    stretch(zone, straight, gradient, 200)
    stretch(turned, oblique, R @ gradient @ R.T, 200)
    xx, yy, zz, xy = fields.stress(zone, straight)[0]
    expected = R @ np.array([[xx, xy], [xy, yy]]) @ R.T
    got = fields.stress(turned, oblique)[0]
    np.testing.assert_allclose(got[[0, 1, 3]], expected[[0, 1, 0], [0, 1, 1]], rtol=1e-9)
    assert got[2] == pytest.approx(zz, rel=1e-10)
