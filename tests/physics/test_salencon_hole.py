"""Salencon's hole in Mohr-Coulomb rock, psi = phi = 30 (scripts/verification/continuum/salencon.py)."""

import pytest
from verification.continuum import salencon


@pytest.fixture(scope="module")
def relieved():
    return salencon.solve(24, 10_000)[0]


def test_closed_form_has_the_reference_values():
    assert pytest.approx(1.73500, rel=1e-5) == salencon.R0
    assert pytest.approx(12.0122e6, rel=1e-5) == salencon.AT_R0
    assert salencon.wall_displacement() == pytest.approx(28.1035e-3, rel=1e-5)


def test_stresses_and_wall(relieved):
    assert salencon.error(relieved) < 0.01
    assert salencon.elastic_plastic_radius(relieved) == pytest.approx(salencon.R0, rel=0.01)
    assert salencon.wall(relieved) == pytest.approx(salencon.wall_displacement(), rel=0.02)


def test_a_linear_ramp_overshoots(relieved):
    """The wall still moves when its support is gone; what that adds is plastic and stays."""
    hurried = salencon.solve(24, 2_000, left=lambda s: 1.0 - s)[0]
    assert salencon.wall(hurried) > 1.05 * salencon.wall(relieved)


def test_zones_lock_without_mixed_discretisation(relieved):
    locked = salencon.solve(12, 0, mixed=False, left=lambda s: 0.0)[0]
    mixed = salencon.solve(12, 0, left=lambda s: 0.0)[0]
    assert salencon.error(locked) > 5.0 * salencon.error(mixed)
