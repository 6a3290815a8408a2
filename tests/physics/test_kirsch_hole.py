"""Kirsch's hole: stresses at 2a, and second order of the error norm (scripts/verification/continuum/kirsch.py)."""

import numpy as np
import pytest
from verification.continuum import kirsch


@pytest.fixture(scope="module")
def rings():
    return {n: kirsch.solve(n)[0] for n in (12, 24)}


def test_closed_form_has_the_reference_values():
    radial, tangential, shear = kirsch.exact(np.array([[0.0, 2.0]]))[0]
    assert (radial, tangential) == pytest.approx((8.4375e6, 36.5625e6))
    assert shear == pytest.approx(0.0, abs=1.0)


def test_stresses_at_two_radii(rings):
    radial, tangential = kirsch.at_two_radii(rings[24])
    assert radial == pytest.approx(8.4375e6, rel=0.02)
    assert tangential == pytest.approx(36.5625e6, rel=0.02)


def test_error_falls_with_the_square_of_the_zones(rings):
    coarse, fine = (kirsch.error(ring) for ring in rings.values())
    assert fine < 0.003
    assert np.log2(coarse / fine) > 1.5


def test_triangles_without_mixed_discretisation_are_worse(rings):
    ring, _ = kirsch.solve(12, mixed=False)
    assert 1.5 * kirsch.error(rings[12]) < kirsch.error(ring) < 4.0 * kirsch.error(rings[12])
