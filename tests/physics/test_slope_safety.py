"""Factors of safety by strength reduction: tan(phi)/F and c/F rest below the factor and flow above it."""

from math import atan, degrees, radians, tan

import numpy as np
import pytest
from zone_cases import slope, soil

from fdm_server.advance import advance
from fdm_server.effects.elastic import Elastic
from fdm_server.effects.mohr_coulomb import MohrCoulomb
from fdm_server.grid import build_grid
from fdm_server.model import build_model, new_state
from fdm_server.motion import unbalanced_ratio, update_velocities

UNIT_WEIGHT, GRAVITY = 20e3, 10.0
STIFF = Elastic(bulk=1e8, shear=3e7)


def rests(zone_size, profile, friction, cohesion, factor, dilates):
    """Whether the slope under slowly growing gravity comes to rest before it has moved by half a metre."""
    phi = degrees(atan(tan(radians(friction)) / factor))
    law = MohrCoulomb(friction=phi, cohesion=cohesion / factor, dilation=phi if dilates else 0.0)
    scene = slope(zone_size, soil(STIFF, law, density=UNIT_WEIGHT / GRAVITY), profile=profile)
    model = build_model(scene, build_grid(scene))
    state = new_state(model)
    grow = 3000
    for step in range(1, 20_001):
        gravity = GRAVITY * min(1.0, step / grow)
        update_velocities(model, state, gravity)
        advance(model, state)
        if step > grow and step % 100 == 0:
            if unbalanced_ratio(model, state, gravity) < 1e-5:
                return True
            if np.abs(state.displacement).max() > 0.5:
                return False
    return False


@pytest.mark.parametrize(("factor", "safe"), [(1.34, True), (1.40, False)])
def test_griffiths_and_lane_1999(factor, safe):
    """Example 1 on a foundation: 2:1, phi = 20, psi = 0, c = .05 gamma H; upper bound 1.368, Bishop 1.380."""
    profile = ((0, 5), (12, 5), (32, 15), (44, 15))
    assert rests([1.0, 0.5], profile, 20.0, 0.05 * UNIT_WEIGHT * 10, factor, dilates=False) is safe


@pytest.mark.parametrize(("factor", "safe"), [(0.99, True), (1.05, False)])
def test_dawson_roth_and_drescher_1999(factor, safe):
    """45 degrees, phi = psi = 20, c = 12.38 kPa, H = 10 m: 1 by limit analysis, somewhat more on a mesh."""
    profile = ((0, 5), (10, 5), (20, 15), (35, 15))
    assert rests(10 / 24, profile, 20.0, 12.38e3, factor, dilates=True) is safe
