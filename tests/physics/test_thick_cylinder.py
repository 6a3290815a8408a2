"""A cylinder under pressure from inside, Lame and Hill (scripts/verification/continuum/cylinder.py)."""

import numpy as np
import pytest
from verification.continuum import cylinder
from verification.continuum.holes import norm, polar


def test_closed_forms_meet_at_the_boundaries():
    assert cylinder.lame(np.array([1.0, 2.0]))[:, 0] == pytest.approx([cylinder.ELASTIC, 0.0])
    assert cylinder.hill(np.array([1.0, 2.0]))[:, 0] == pytest.approx([cylinder.PLASTIC, 0.0])
    below, above = cylinder.hill(np.array([1.5 - 1e-9, 1.5 + 1e-9]))
    assert below == pytest.approx(above, rel=1e-6)


def test_lame():
    errors = []
    for n in (8, 16):
        ring = cylinder.solve(n, cylinder.ELASTIC, 500)
        errors.append(norm(ring, -polar(ring)[:, :2] - cylinder.lame(ring.radius)) / cylinder.ELASTIC)
    assert errors[1] < 0.006
    assert np.log2(errors[0] / errors[1]) > 1.5


def test_hill():
    ring = cylinder.solve(16, cylinder.PLASTIC, 5_000)
    outside = (1.0 - cylinder.NU) * cylinder.COHESION * cylinder.D**2 / (cylinder.G * cylinder.B)
    assert cylinder.moved(ring, ring.outer) == pytest.approx(outside, rel=0.02)
    assert norm(ring, -polar(ring)[:, :2] - cylinder.hill(ring.radius)) / cylinder.PLASTIC < 0.02
