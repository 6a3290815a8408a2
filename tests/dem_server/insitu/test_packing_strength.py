"""The cone of stresses a packing can carry, and bringing stresses inside it."""

import numpy as np
import pytest
from window_case import SQUARE, packed, packed_with_stones, soil_discs

from coupler_protocol.geometry import polygon_area
from dem_server.insitu.contact_stress import mean_stress
from dem_server.insitu.packing_strength import friction_sine, inside_cone, mixture_sine, tensile_strength
from dem_server.pairs import contacts

STRESS = np.array([[-1, -1, 0], [-1, -2, 0], [-1, -9, 0], [-5, -5, 4], [1, 2, 0.5]], dtype=float)


def test_friction_cone():
    inside, share = inside_cone(STRESS, 0.4)
    assert share == pytest.approx(3 / 5)
    np.testing.assert_array_equal(inside[:2], STRESS[:2])
    np.testing.assert_allclose(inside[2:], [[-3, -7, 0], [-5, -5, 2], [0, 0, 0]], atol=1e-15)


def test_tension_moves_the_tip():
    inside, share = inside_cone(STRESS, 0.4, tension=5.0)
    assert share == pytest.approx(1 / 5)  # mean tension is never asked for
    np.testing.assert_allclose(inside[:4], STRESS[:4], atol=1e-15)
    np.testing.assert_allclose(inside[4], [-0.5, 0.5, 0.5], atol=1e-15)


def test_friction_angle_of_the_packing():
    model, _ = packed(SQUARE, soil_discs(radius=0.08))
    assert np.degrees(np.arcsin(friction_sine(model))) == pytest.approx(24.2, abs=0.1)
    model, _ = packed(SQUARE, soil_discs(radius=0.08, friction=None))
    assert friction_sine(model) == 0.0


def test_friction_angle_of_a_mixture():
    """The mean of the sines over the area, 1 in stones: that of the soil without stones, some 44 degrees with 45 % of them."""
    model, state = packed(SQUARE, soil_discs())
    assert mixture_sine(model, state) == friction_sine(model)
    model, state, _ = packed_with_stones(SQUARE)
    shares = np.where(state.stone < 0, friction_sine(model), 1.0)[model.ring :]
    solid = state.radius[model.ring :] ** 2
    assert mixture_sine(model, state) == pytest.approx((shares * solid).sum() / solid.sum(), rel=1e-12)
    assert np.degrees(np.arcsin(mixture_sine(model, state))) == pytest.approx(44.0, abs=2.0)


def test_tensile_strength_is_the_stress_of_all_bonds_at_their_strength():
    model, state = packed(SQUARE, soil_discs(radius=0.06))
    pairs = contacts(state)
    torn = pairs._replace(normal_force=np.full(len(pairs.slot), -1.5e3), shear_force=0.0 * pairs.shear_force)
    stress = mean_stress(torn, polygon_area(SQUARE))
    assert tensile_strength(model, state) == pytest.approx(0.5 * (stress[0] + stress[1]), rel=1e-12)
    model, state = packed(SQUARE, soil_discs(radius=0.06, bond=False))
    assert tensile_strength(model, state) == 0.0
