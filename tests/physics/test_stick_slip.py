"""Stick and slip over many cycles: nothing else is gained or lost (scripts/verification/discrete/stickslip.py)."""

import pytest
from verification.discrete import stickslip
from verification.discrete.discs import KN, KS, MU


def test_slip():
    done, kept, expected = stickslip.slipping()
    assert done == pytest.approx(expected, rel=1e-4)
    assert kept == pytest.approx((MU * KN * stickslip.OVERLAP) ** 2 / (2.0 * KS), rel=1e-6)


def test_rolling():
    done, expected = stickslip.rolling()
    assert done == pytest.approx(expected, rel=1e-4)
