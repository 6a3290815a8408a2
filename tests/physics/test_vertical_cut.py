"""A vertical cut in clay stands up to gamma H/c = 3.78 (scripts/verification/continuum/slopes.py)."""

import pytest
from verification.continuum import slopes


def test_a_vertical_cut_at_the_height_of_limit_analysis_has_a_factor_of_one():
    found = slopes.factors(slopes.cut((4, 8, 16)))
    values = [mesh["value"] for mesh in found["meshes"]]
    assert values == sorted(values, reverse=True)
    assert found["extrapolation"]["value"] == pytest.approx(1.0, abs=0.02)
