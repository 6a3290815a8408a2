"""Softening by plastic shear strain: one zone follows the closed form, whatever the direction of its grid.

Plane shear g of soil without friction, cohesion c0 - h k with k half the plastic angle: tau = c0 - h (g - tau/G)/2, so
tau (1 - h/2G) = c0 - h g/2 until c has fallen to its last value. Oedometer with constant friction, on the edge s2 = s3: with
m1, m23 and N of the law, a multiplier L < 0 gives k = -L (2 + Np)/sqrt(12), and f = s1 - N s3 + 2 sqrt(N)(c0 - h k) = 0 fixes L.
"""

from math import cos, radians, sin, sqrt

import numpy as np
import pytest
from pydantic import ValidationError
from zone_cases import box, sides, soil, stretch

from fdm_server.effects.elastic import Elastic
from fdm_server.effects.mohr_coulomb import MohrCoulomb
from fdm_server.effects.softening import Softening
from fdm_server.effects.tension import Tension
from fdm_server.mesh.grid import build_grid
from fdm_server.model import build_model, new_state
from fdm_server.observe import fields
from fdm_server.step.gridpoint_pass import update_velocities
from fdm_server.step.zone_pass import advance

STIFF = Elastic(bulk=200e6, shear=100e6)
K, G = STIFF.bulk, STIFF.shear
A1, A2 = K + 4 * G / 3, K - 2 * G / 3


def zone(angle=0.0, **laws):
    """One square zone, its grid turned by an angle [deg]."""
    a = radians(angle)
    R = np.array([[cos(a), -sin(a)], [sin(a), cos(a)]])
    scene = box(1.0, 1.0, 1.0, soil(STIFF, **laws))
    grid = build_grid(scene)
    model = build_model(scene, grid._replace(xy=grid.xy @ R.T))
    return model, new_state(model), R


@pytest.mark.parametrize("angle", [0.0, 30.0, 73.0])
def test_plane_shear_of_clay(angle):
    c0, c1, k1 = 1e6, 0.4e6, 0.01
    h = (c0 - c1) / k1
    clay = MohrCoulomb(friction=0, cohesion=c0)
    model, state, R = zone(angle, mohr_coulomb=clay, softening=Softening(strain=[k1, 0.5], cohesion=[c1, c1]))
    steps, total = 4000, 0.04
    taus = []
    for _ in range(steps):
        stretch(model, state, R @ np.array([[0.0, total / steps], [0.0, 0.0]]) @ R.T)
        xx, yy, _, xy = fields.stress(model, state)[0]
        taus.append((R.T @ np.array([[xx, xy], [xy, yy]]) @ R)[0, 1])
    g = np.arange(1, steps + 1) * total / steps
    exact = np.minimum(G * g, np.maximum((c0 - h * g / 2) / (1 - h / (2 * G)), c1))
    np.testing.assert_allclose(taus, exact, atol=2e-3 * c0)  # the lag of one step
    assert taus[-1] == pytest.approx(c1, rel=1e-9)
    assert fields.plastic_shear_strain(model, state)[0] == pytest.approx((total - c1 / G) / 2, rel=1e-4)


def test_nothing_softens_while_a_zone_is_unloaded():
    clay = MohrCoulomb(friction=0, cohesion=1e6)
    model, state, _ = zone(mohr_coulomb=clay, softening=Softening(strain=[0.1], cohesion=[0.5e6]))
    stretch(model, state, [[0.0, 0.03], [0.0, 0.0]], 1000)
    before = fields.plastic_shear_strain(model, state)[0]
    stretch(model, state, [[0.0, -0.01], [0.0, 0.0]], 1000)  # elastic: the span is 2 c/G = 0.02
    assert before > 0.0
    assert fields.plastic_shear_strain(model, state)[0] == before


def test_the_lag_is_of_first_order():
    found = []
    for steps in (500, 1000, 2000):
        clay = MohrCoulomb(friction=0, cohesion=1e6)
        model, state, _ = zone(mohr_coulomb=clay, softening=Softening(strain=[0.1], cohesion=[0.0]))
        stretch(model, state, [[0.0, 0.04], [0.0, 0.0]], steps)
        h = 1e6 / 0.1
        found.append(fields.stress(model, state)[0, 3] - (1e6 - h * 0.02) / (1 - h / (2 * G)))
    assert found[0] / found[1] == pytest.approx(2.0, rel=0.02)
    assert found[1] / found[2] == pytest.approx(2.0, rel=0.02)


@pytest.mark.parametrize("angle", [0.0, 41.0])
@pytest.mark.parametrize("dilation", [0.0, 10.0])
def test_oedometer_along_the_edge(dilation, angle):
    phi, c0, h, strain = 10.0, 1e6, 30e6, 0.02
    law = MohrCoulomb(friction=phi, cohesion=c0, dilation=dilation)
    model, state, R = zone(angle, mohr_coulomb=law, softening=Softening(strain=[c0 / h], cohesion=[0.0]))
    stretch(model, state, R @ np.diag([0.0, -strain]) @ R.T, 20000)
    N, Np = ((1 + sin(radians(a))) / (1 - sin(radians(a))) for a in (phi, dilation))
    m1, m23 = A1 - A2 * Np, 0.5 * (A2 * (1 - Np) + A2 - A1 * Np)
    hard = 2 * sqrt(N) * h * (2 + Np) / sqrt(12)
    L = (-A1 * strain + N * A2 * strain + 2 * sqrt(N) * c0) / (m1 - N * m23 - hard)
    xx, yy, zz, xy = fields.stress(model, state)[0]
    stress = R.T @ np.array([[xx, xy], [xy, yy]]) @ R
    assert L < 0
    assert stress[1, 1] == pytest.approx(-A1 * strain - L * m1, rel=1e-4)
    assert stress[0, 0] == pytest.approx(-A2 * strain - L * m23, rel=1e-4)
    assert zz == pytest.approx(stress[0, 0], rel=1e-9)
    assert fields.plastic_shear_strain(model, state)[0] == pytest.approx(-L * (2 + Np) / sqrt(12), rel=1e-4)


def test_biaxial_compression_passes_a_peak_and_ends_at_the_last_strength():
    """Between smooth plates under lateral pressure p: peak N p + 2 c sqrt(N), end the same with the last values."""
    p, peak, last = 100e3, MohrCoulomb(friction=35, cohesion=50e3, dilation=10), MohrCoulomb(friction=25, cohesion=0)
    softening = Softening(strain=[0.005, 0.02], cohesion=[10e3, 0.0], friction=[30, 25], dilation=[5, 0])
    scene = box(1.0, 1.0, 1.0, soil(STIFF, mohr_coulomb=peak, softening=softening), boundary=sides(left="x", bottom="y"))
    model = build_model(scene, build_grid(scene))
    state = new_state(model)
    stretch(model, state, -np.eye(2) * p / (A1 + A2))
    state.applied[model.grid.xy[:, 0] == 1.0, 0] = -0.5 * p
    plate, top = model.grid.xy[:, 1] == 1.0, []
    for rate, steps in ((2e-6, 12000), (1e-8, 4000)):
        for _ in range(steps):
            update_velocities(model, state, 0.0)
            state.velocity[plate, 1] = -rate
            advance(model, state)
            top.append(-fields.stress(model, state)[0, 1])

    def strength(law):
        N = (1 + sin(radians(law.friction))) / (1 - sin(radians(law.friction)))
        return N * p + 2 * law.cohesion * sqrt(N)

    assert strength(last) < 0.7 * strength(peak)
    assert max(top) == pytest.approx(strength(peak), rel=2e-2)
    assert top[-1] == pytest.approx(strength(last), rel=1e-4)


def test_tensile_strength_falls_with_plastic_shear_strain():
    model, state, _ = zone(
        mohr_coulomb=MohrCoulomb(friction=20, cohesion=1e6),
        tension=Tension(strength=0.5e6),
        softening=Softening(strain=[0.01], tension=[0.1e6]),
    )
    stretch(model, state, [[0.0, 0.05], [0.0, 0.0]], 500)
    stretch(model, state, [[0.02, 0.0], [0.0, 0.02]], 100)
    np.testing.assert_allclose(fields.stress(model, state)[0, :2].max(), 0.1e6, rtol=1e-9)


def test_a_curve_that_stays_is_no_softening():
    """The same bits up to rounding as without the table, also beside a material that has none."""
    law = MohrCoulomb(friction=25, cohesion=1e6, dilation=10)
    found = []
    for softening in (None, Softening(strain=[0.01], cohesion=[1e6])):
        scene = box(
            *(2.0, 1.0, 1.0),
            soil(STIFF, mohr_coulomb=law, tension=Tension(strength=1e5), softening=softening),
            soil(STIFF, region=[(1, 0), (2, 0), (2, 1), (1, 1)], name="rock"),
        )
        model = build_model(scene, build_grid(scene))
        state = new_state(model)
        stretch(model, state, [[0.004, 0.01], [0.0, -0.02]], 50)
        found.append(fields.stress(model, state))
    np.testing.assert_allclose(found[1], found[0], rtol=1e-11, atol=1e-3)


@pytest.mark.parametrize(
    "keys",
    [
        {"strain": [0.01]},
        {"strain": [0.01, 0.01], "cohesion": [1, 0]},
        {"strain": [0.0], "cohesion": [1]},
        {"strain": [0.01], "cohesion": [1, 2]},
        {"strain": [0.01], "friction": [60]},
        {"strain": [0.01], "tension": [-1]},
    ],
)
def test_tables_without_sense_are_refused(keys):
    with pytest.raises(ValidationError):
        Softening(**keys)
