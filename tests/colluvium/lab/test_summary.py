"""Means, scatter, and tests at half the rate: a change beyond the scatter is called one."""

import pytest

from colluvium.lab.summary import as_lines, summary


def row(seed, value, factor=1.0):
    place = {"name": f"{seed}", "sample": "soil", "pressure": 1e5, "seed": seed, "factor": factor}
    return place | {"peak_side": 1e5, "residual_side": 1e5, "peak_axial": value, "residual_axial": 0.5 * value}


def test_means_and_scatter_are_over_seeds():
    found = summary("biaxial", [row(1, 3e5), row(2, 5e5)])
    (entry,) = found["samples"]["soil"]["means"]
    assert entry["peak_axial"] == {"mean": 4e5, "sd": pytest.approx(2e5 / 2.0**0.5)}
    assert found["samples"]["soil"]["peak"] is None  # one stress has no line


@pytest.mark.parametrize(("change", "within"), [(1e3, True), (1e5, False)])
def test_half_the_rate_is_compared_with_the_scatter(change, within):
    rows = [row(1, 3.0e5), row(2, 3.2e5), row(1, 3.0e5 + change, 0.5), row(2, 3.2e5 + change, 0.5)]
    found = summary("biaxial", rows)
    rates = {entry["answer"]: entry for entry in found["rates"]}
    assert rates["peak_axial"]["change"] == pytest.approx(change)
    assert rates["peak_axial"]["within"] is within
    text = " ".join(as_lines(found))
    assert ("lower lab.rate" in text) is not within
    assert found["samples"]["soil"]["means"][0]["samples"] == 2  # slower trials are not averaged in
