"""Quadrilaterals bend: a cantilever against Timoshenko's beam, second order (scripts/verification/continuum/beam.py)."""

import pytest
from verification.continuum import beam


def test_a_cantilever_of_four_zones_is_eight_per_cent_too_stiff():
    coarse, fine = beam.bent(2), beam.bent(4)
    assert fine == pytest.approx(beam.DEFLECTION, rel=0.1)
    assert (4.0 * fine - coarse) / 3.0 == pytest.approx(beam.DEFLECTION, rel=0.03)
