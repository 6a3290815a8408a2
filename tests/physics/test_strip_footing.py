"""Rough strip footings carry Prandtl's pressure, unless zones lock (scripts/verification/continuum/footing.py)."""

import pytest
from verification.continuum import footing


def test_prandtl():
    assert footing.prandtl(0.0) == pytest.approx(5.1416, rel=1e-5)
    assert footing.prandtl(20.0) == pytest.approx(14.835, rel=1e-4)
    assert footing.prandtl(0.01) == pytest.approx(5.1416, rel=1e-3)


@pytest.mark.parametrize("parts", [4, 8])
def test_pressure_lies_little_above_that_of_collapse(parts):
    assert 1.0 < footing.collapse(parts) / footing.prandtl(0.0) < 1.03


def test_zones_lock_without_mixed_discretisation():
    assert footing.locked(4) > 1.3 * footing.prandtl(0.0)
