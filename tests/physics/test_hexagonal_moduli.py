"""Hexagonal packing under uniform strain (scripts/verification/discrete/hexagon.py)."""

import numpy as np
import pytest
from verification.discrete.hexagon import C11, C12, G, moduli


@pytest.mark.parametrize("turned", [0.0, 0.2, 0.9])
@pytest.mark.parametrize(
    ("strain", "expected"),
    [
        ([[1.0, 0.0], [0.0, 0.0]], [C11, C12, 0.0]),
        ([[0.0, 0.0], [0.0, 1.0]], [C12, C11, 0.0]),
        ([[0.0, 0.5], [0.5, 0.0]], [0.0, 0.0, G]),
    ],
)
def test_moduli(strain, expected, turned):
    np.testing.assert_allclose(moduli(strain, turned), expected, rtol=1e-8, atol=1e-8 * C11)
