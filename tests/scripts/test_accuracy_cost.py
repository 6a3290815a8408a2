"""scripts/accuracy_cost.py: rows, picture and section of a workload."""

import numpy as np
import pytest
from accuracy.common import timed
from verification.orders import order

from tests.scripts.workload import computed


def test_order_is_the_slope_of_the_logarithms():
    sizes = np.array([0.4, 0.2, 0.1])
    assert order(sizes, 3.0 * sizes**1.7) == pytest.approx(1.7)
    assert order(sizes, [0.0, 0.0, 1.0]) is None


def test_seconds_are_a_median_and_the_result_is_kept():
    calls = []
    seconds, spread, result = timed(lambda: calls.append(1) or len(calls), repeats=3)
    assert (len(calls), result) == (3, 3)
    assert seconds > 0.0
    assert spread >= 0.0


@pytest.mark.trial
@pytest.mark.long
def test_w1_reports_both_holes(tmp_path):
    found, page = computed("W1", tmp_path)
    assert {row["case"] for row in found} == {"Kirsch", "Salencon"}
    assert {"case", "method", "error", "seconds", "spread", "repeats", "order", "reference"} <= found[0].keys()
    best = [row for row in found if row["method"] == "ratio 1e-07"]
    assert all(row["order"] > 1.2 for row in best)
    without = [row for row in found if row["method"].startswith("without")]
    assert all(plain["error"] > mixed["error"] for plain, mixed in zip(without, best, strict=True))
    assert "## W1: " in page


@pytest.mark.trial
@pytest.mark.long
def test_w3_finds_order_two_and_the_floors_of_the_model(tmp_path):
    rows, page = computed("W3", tmp_path)
    assert {row["case"] for row in rows} == {"disc on a bar", "wave", "energy of a chain"}
    assert {"method", "error", "seconds", "spread", "repeats", "order", "reference"} <= rows[0].keys()
    found = {(row["case"], row["method"]): row for row in rows}
    assert found["energy of a chain", "leap-frog"]["order"] == pytest.approx(2.0, abs=0.2)
    wave = [found["wave", method]["error"] for method in ("with the half disc's mass", "without")]
    assert wave[0] < 1e-3 < 20.0 * wave[0] < wave[1]
    assert "## W3: " in page
