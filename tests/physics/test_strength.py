"""Strength of Mohr-Coulomb soil with tension cut-off: biaxial compression, opening cracks, the apex."""

from math import radians, sin, sqrt, tan

import numpy as np
import pytest
from zone_cases import PAPER, box, sides, soil, stretch

from fdm_server.effects.mohr_coulomb import MohrCoulomb
from fdm_server.effects.tension import Tension
from fdm_server.mesh.grid import build_grid
from fdm_server.model import build_model, new_state
from fdm_server.observe import fields
from fdm_server.step.gridpoint_pass import update_velocities
from fdm_server.step.stress import SM, ZZ
from fdm_server.step.zone_pass import advance

PHI, COHESION, STRENGTH = 30.0, 50e3, 10e3
N = (1 + sin(radians(PHI))) / (1 - sin(radians(PHI)))
C = 2 * COHESION * sqrt(N)
A1, A2 = PAPER.bulk + 4 * PAPER.shear / 3, PAPER.bulk - 2 * PAPER.shear / 3
LAW = MohrCoulomb(friction=PHI, cohesion=COHESION)


def zone(**laws):
    scene = box(1.0, 1.0, 1.0, soil(**laws))
    model = build_model(scene, build_grid(scene))
    return model, new_state(model)


@pytest.mark.parametrize("dilation", [0.0, 10.0, 30.0])
@pytest.mark.parametrize("pressure", [0.0, 100e3])
def test_biaxial_compression_ends_at_mohr_coulomb(dilation, pressure):
    """Between smooth plates that approach, under constant lateral pressure: s1 = N p + C, whatever psi."""
    law = MohrCoulomb(friction=PHI, cohesion=COHESION, dilation=dilation)
    scene = box(2.0, 2.0, 1.0, soil(mohr_coulomb=law), boundary=sides(bottom="y", top="y"))
    model = build_model(scene, build_grid(scene))
    model.fixed[0, 0] = True
    state = new_state(model)
    stretch(model, state, np.diag([-1.0, -1.0]) * pressure / (A1 + A2))
    x, y = model.grid.xy.T
    push = pressure * np.where((y == 0) | (y == 2), 0.5, 1.0)
    state.applied[:, 0] = push * ((x == 0).astype(float) - (x == 2).astype(float))
    plate = np.flatnonzero(y == 2)
    for rate, steps in ((1e-6, 4000), (1e-8, 6000)):
        for _ in range(steps):
            update_velocities(model, state, 0.0)
            state.velocity[plate, 1] = -rate
            advance(model, state)
    stress = fields.stress(model, state)
    np.testing.assert_allclose(-stress[:, 1], N * pressure + C, rtol=1e-4)
    assert np.all(fields.plastic_state(model, state) & 1)


def test_crack_opens_at_the_tensile_strength():
    """Uniaxial strain far beyond the strength: s = st across the crack, a2/a1 st along it."""
    model, state = zone(mohr_coulomb=LAW, tension=Tension(strength=STRENGTH))
    stretch(model, state, [[1e-3, 0], [0, 0]], 100)
    xx, yy, zz, _ = fields.stress(model, state)[0]
    assert xx == pytest.approx(STRENGTH, rel=1e-12)
    assert yy == pytest.approx(STRENGTH * A2 / A1, rel=1e-9)
    assert zz == pytest.approx(STRENGTH * A2 / A1, rel=1e-9)
    assert fields.plastic_state(model, state)[0] == 2 | 8


def test_cracks_open_two_ways():
    """Both directions of the plane crack; the third keeps 2 st a2/(a1 + a2) of the elastic part."""
    model, state = zone(tension=Tension(strength=STRENGTH))
    stretch(model, state, [[1e-3, 0], [0, 2e-3]])
    xx, yy, zz, _ = fields.stress(model, state)[0]
    np.testing.assert_allclose([xx, yy], STRENGTH, rtol=1e-9)
    assert zz == pytest.approx(2 * STRENGTH * A2 / (A1 + A2), rel=1e-9)


def test_cracks_open_three_ways():
    """Extension without a plane-strain constraint: a stress of 3 st all round is cut to st."""
    model, state = zone(tension=Tension(strength=STRENGTH))
    state.stress[:] = 0.0
    state.stress[0, [SM, ZZ]] = 3 * STRENGTH
    advance(model, state)
    np.testing.assert_allclose(fields.stress(model, state)[0, :3], STRENGTH, rtol=1e-12)


def test_apex_without_cut_off():
    """Isotropic extension ends where all strength ends, c/tan(phi)."""
    model, state = zone(mohr_coulomb=MohrCoulomb(friction=PHI, cohesion=COHESION, dilation=PHI))
    stretch(model, state, [[1e-2, 0], [0, 1e-2]], 50)
    np.testing.assert_allclose(fields.stress(model, state)[0, :3], COHESION / tan(radians(PHI)), rtol=1e-9)


def test_strength_is_capped_by_the_apex():
    model, state = zone(mohr_coulomb=LAW, tension=Tension(strength=1e9))
    stretch(model, state, [[1e-2, 0], [0, 1e-2]], 50)
    assert fields.stress(model, state)[0, :3].max() <= COHESION / tan(radians(PHI)) * (1 + 1e-9)


def test_state_remembers_earlier_yielding():
    model, state = zone(mohr_coulomb=LAW)
    stretch(model, state, [[0, 1e-2], [0, 0]], 10)
    assert fields.plastic_state(model, state)[0] == 1 | 4
    stretch(model, state, [[0, -1e-4], [0, 0]])  # unloading
    assert fields.plastic_state(model, state)[0] == 4


def test_soil_without_friction_or_strength_stays_finite():
    for law in (MohrCoulomb(friction=0, cohesion=COHESION), MohrCoulomb(friction=55, cohesion=0)):
        model, state = zone(mohr_coulomb=law, tension=Tension(strength=0))
        for gradient in ([[1e-3, 2e-3], [0, -3e-3]], [[5e-3, 0], [0, 5e-3]], [[-1e-2, 0], [1e-3, -2e-2]]):
            stretch(model, state, gradient, 7)
            xx, yy, zz, xy = fields.stress(model, state)[0]
            r = np.hypot(0.5 * (xx - yy), xy)
            s1, _, s3 = sorted([0.5 * (xx + yy) - r, 0.5 * (xx + yy) + r, zz])
            ratio = (1 + sin(radians(law.friction))) / (1 - sin(radians(law.friction)))
            assert s3 <= 1e-6
            assert s1 - ratio * s3 + 2 * law.cohesion * sqrt(ratio) >= -1e-6 * (1 + abs(s1))
