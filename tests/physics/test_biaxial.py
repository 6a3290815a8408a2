"""Biaxial compression: Mohr-Coulomb strength and dilation by the plastic potential (scripts/verification, biaxial.py)."""

from math import sqrt

import pytest
from verification.continuum import biaxial


@pytest.mark.parametrize("pressure", [50e3, 200e3])
def test_strength_and_dilation(pressure):
    first, second = (biaxial.pressed(pressure, strain) for strain in (0.04, 0.08))
    assert second[0] == pytest.approx(biaxial.N * pressure + 2.0 * biaxial.COHESION * sqrt(biaxial.N), rel=1e-10)
    assert (second[1] - first[1]) / 0.04 == pytest.approx(biaxial.NP, rel=1e-10)
