"""P and S waves at their speeds and by the leap-frog's dispersion law, through a scene (scripts/verification, waves.py)."""

import pytest
from verification.continuum import waves


def test_speeds_of_the_paper_material():
    assert waves.SPEED["xx"] == pytest.approx(509.2, abs=0.05)
    assert waves.SPEED["xy"] == pytest.approx(235.7, abs=0.05)


@pytest.mark.parametrize("component", ["xx", "xy"])
@pytest.mark.parametrize("mode", [1, 9, 20])
def test_waves_follow_the_dispersion_law(component, mode):
    value, law = waves.speeds(component, mode, 3)
    assert value == pytest.approx(law, rel=1e-9)
    if mode == 1:
        assert value == pytest.approx(waves.SPEED[component], rel=1e-3)
