"""Earth pressure on a smooth wall, active and passive (scripts/verification/continuum/rankine.py)."""

import pytest
from verification.continuum import rankine

WEIGHT = 0.5 * rankine.DENSITY * rankine.GRAVITY * rankine.HEIGHT**2


def test_rankine_active():
    assert rankine.force_on_wall(1.0, 0.0, 0.04, 10_000) == pytest.approx(WEIGHT / 3.0, rel=1e-6)


def test_rankine_passive():
    exact = 3.0 * WEIGHT + 2.0 * 10e3 * 3.0**0.5 * rankine.HEIGHT
    assert rankine.force_on_wall(1.0, 10e3, -0.2, 10_000) == pytest.approx(exact, rel=1e-6)


def test_local_damping_does_not_know_a_steady_motion():
    """It takes more from swings against the motion than from those with it; combined damping takes the same."""
    exact = 3.0 * WEIGHT + 2.0 * 10e3 * 3.0**0.5 * rankine.HEIGHT
    found = rankine.force_on_wall(1.0, 10e3, -0.2, 10_000, {"local": 0.8})
    assert found == pytest.approx(exact, rel=0.02)
    assert found != pytest.approx(exact, rel=1e-3)
