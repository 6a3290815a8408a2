"""A disc on a plane of 30 degrees rolls, slides or, with rolling resistance, stays."""

import numpy as np
import pytest
from verification.discrete.incline import SLOPE, G, R, acceleration, on_plane

from dem_server.effects.damping import Damping
from dem_server.step.cycle import advance


@pytest.mark.parametrize("friction", [0.195, 0.3, 1.0])
def test_rolls_where_friction_suffices(friction):
    found, turned = acceleration(SLOPE, friction)
    assert found == pytest.approx(3.27, rel=1e-4)
    assert turned == pytest.approx(1.0, rel=1e-3)


def test_slides_where_it_does_not():
    found, turned = acceleration(SLOPE, 0.1)
    assert found == pytest.approx(4.0554, rel=1e-4)
    assert turned == pytest.approx(2.0 * 0.1 * np.cos(SLOPE) * G / 4.0554, rel=3e-3)  # it sticks at first


def test_friction_at_the_limit_of_rolling():
    """tan(30) / 3 = .19245: below it the disc turns too little, above it rolls."""
    assert acceleration(SLOPE, 0.190)[1] < 0.99
    assert acceleration(SLOPE, 0.195)[1] > 0.999


@pytest.mark.parametrize("rolling", [0.1, 0.3])
def test_rolling_resistance_slows_down(rolling):
    found, _ = acceleration(SLOPE, 1.0, rolling)
    assert found == pytest.approx(2.0 / 3.0 * G * (np.sin(SLOPE) - rolling * np.cos(SLOPE)), rel=1e-3)


@pytest.mark.parametrize("slope", [0.1, 0.3])
def test_rolling_resistance_holds_up_to_its_slope(slope):
    way = []
    for factor in (1.03, 0.97):
        model, state = on_plane(slope, 2.0, factor * np.tan(slope), Damping(local=0.7))
        start = state.x[1].copy()
        advance(model, state, G, 50000)
        way.append(np.hypot(*(state.x[1] - start)))
    assert way[0] < 1e-3 * R
    assert way[1] > R
