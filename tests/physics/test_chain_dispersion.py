"""Waves along a chain of bonded discs: omega = 2 sqrt(k/m) sin(q l / 2) (scripts/verification/discrete/chain.py)."""

import pytest
from verification.discrete import chain


@pytest.mark.parametrize("turned", [0.0, 0.8])
@pytest.mark.parametrize("wave", [1, 5, 16])
def test_standing_wave(wave, turned):
    found, expected = chain.frequencies(wave, turned)
    assert found == pytest.approx(expected, rel=1e-6)
