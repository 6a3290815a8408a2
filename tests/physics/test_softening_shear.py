"""Simple shear of a softening zone follows its closed form (scripts/verification/continuum/softening.py)."""

import numpy as np
import pytest
from verification.continuum import softening


def test_peak_slope_and_residual_strength():
    errors = []
    for steps in (1_000, 2_000):
        gamma, stress = softening.sheared(steps)
        errors.append(np.abs(stress - softening.exact(gamma)).max() / softening.C0)
    assert stress[-1] == pytest.approx(softening.C1, rel=1e-9)
    assert errors[1] < 0.01
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.2)  # first order: strength lags behind by a step
