"""The study of the errors of regions: its rows, and their texts."""

import measuring_study
import pytest
from fabric_study import Case


def test_a_line_of_the_table():
    row = {
        "case": "small",
        "region": "circle",
        "bodies": 61.4,
        "quantity": "porosity",
        "mean": 0.15,
        "scatter": 2e-3,
        "ratio": 1.1,
    }
    line = measuring_study.line_of(row | {"within": 0.9})
    assert len(line) == len(measuring_study.HEAD)
    assert line[2:] == ["61", "porosity", "0.15", "2e-3", "1.10", "0.90"]


@pytest.mark.long
def test_errors_are_of_the_size_of_the_scatter():
    """Six packings: their scatter is known within a factor of two."""
    rows = {(row["region"], row["quantity"]): row for row in measuring_study.rows(Case("small", 0.8), range(1, 7))}
    assert len({region for region, _ in rows}) == 4
    for (region, quantity), row in rows.items():
        if "0.32" in region and quantity in ("stress_yy", "porosity", "coordination"):
            assert 0.3 < row["ratio"] < 4.0, (region, quantity)
            assert row["within"] >= 0.5
