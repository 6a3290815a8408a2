"""A strip load on an elastic layer: Fourier series of Airy's function (scripts/verification/continuum/strip_load.py)."""

import numpy as np
import pytest
from verification.continuum import strip_load


def test_series_tends_to_boussinesq_below_the_strip():
    """p/pi (alpha + sin alpha) at depth b of a half-space; the base at 5b and the walls at 10b add some percent."""
    vertical = -strip_load.exact(np.array([[0.0, strip_load.H - strip_load.B]]))[0, 1]
    assert vertical == pytest.approx(strip_load.P * (0.5 + 1.0 / np.pi), rel=0.05)


def test_series_carries_the_load_on_any_level():
    x = (np.arange(500) + 0.5) * strip_load.L / 500
    for y in (0.0, 2.0):
        vertical = strip_load.exact(np.column_stack([x, np.full_like(x, y)]))[:, 1]
        assert -vertical.mean() * strip_load.L == pytest.approx(strip_load.P * strip_load.B, rel=1e-9)


def test_stresses_and_settlement():
    errors, settlements = zip(*(strip_load.solve(size) for size in (0.5, 0.25)), strict=True)
    assert errors[1] < 2e-3
    assert np.log2(errors[0] / errors[1]) > 1.5
    assert settlements[1] == pytest.approx(strip_load.settlement(), rel=5e-3)
