"""The study of packings: its numbers for the coarsest discs, within what the page says."""

import packing_study
import pytest


@pytest.mark.parametrize("how", ["relaxed", "inward"])
def test_a_row(how):
    row = packing_study.measured(how, 0.1, 1)
    assert list(row) == list(packing_study.COLUMNS)
    assert abs(row["stress error"]) < 0.03
    assert 0.15 < row["porosity"] < 0.19
    assert 3.8 < row["coordination"] < 4.5
    assert row["anisotropy a"] < 0.2


def test_ranges_over_seeds():
    rows = [{"porosity": 0.15, "discs": 100.0}, {"porosity": 0.16, "discs": 100.0}]
    assert packing_study.range_of(rows, "porosity") == "0.1500 to 0.1600"
    assert packing_study.range_of(rows, "discs") == "100"
