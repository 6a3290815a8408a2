"""scripts/accuracy_cost.py W6: the coupled slope against its number of discs."""

import accuracy_cost
import pytest
from accuracy import w6_coupled_slope as w6

from tests.scripts.workload import computed


def row(case, failure, half, seconds=10.0, about=1000, method="45 %"):
    return {
        "case": case, "method": method, "about": about, "discs": about, "failure": failure, "failure_half": half,
        "seconds": seconds, "failed": "",
    }  # fmt: skip


def test_intervals_are_students_below_ten_seeds():
    mean, half = w6.mean_and_half([1.0, 2.0, 3.0, 4.0, 5.0])
    assert mean == 3.0
    assert half == pytest.approx(2.7764 * 2.5**0.5 / 5**0.5, rel=1e-4)
    assert w6.mean_and_half([2.0]) == (2.0, None)
    assert w6.mean_and_half([]) == (None, None)


def test_directions_repeat_after_half_a_turn():
    axis, half = w6.axis_and_half([178.0, 2.0, 0.0])
    assert min(axis, 180.0 - axis) == pytest.approx(0.0, abs=1e-9)
    assert half == pytest.approx(4.3027 * 2.0 / 3**0.5, rel=1e-4)


def test_it_is_said_when_the_continuum_alone_would_have_done():
    alone = row("continuum", 5.0, None, seconds=2.0, about=0, method="-")
    within, off = w6.said([row("calibrated", 5.2, 0.3), row("printed", 4.0, 0.3), alone])
    assert "would have done" in within
    assert "1/5 of the seconds" in within
    assert "off by +25 %" in off


def test_settings_have_both_calibrations_and_seeds_enough_for_intervals():
    found = w6.settings(False)
    assert {case for case, *_ in found} == {"calibrated", "printed"}
    assert sorted({about for _, _, about, _, _ in found}) == [1000, 3000, 10_000, 30_000]
    assert all(seeds >= 5 for _, _, about, seeds, _ in found if about < w6.MOST)


def test_every_study_is_a_workload():
    assert list(accuracy_cost.workloads()) == ["W1", "W2", "W3", "W4", "W5", "W6"]


@pytest.mark.long
def test_the_slope_has_its_numbers_and_a_second_study_computes_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(w6, "FAST_RADII", {140: 0.09})
    kept = tmp_path / "kept"
    rows, page = computed("W6", tmp_path, "--out", str(kept))
    by_case = {row["case"]: row for row in rows}
    assert list(by_case) == ["calibrated", "printed", "continuum"]
    for case in ("calibrated", "printed"):
        one = by_case[case]
        assert (one["seeds"], one["failed"]) == (2, "")
        assert len(set(one["values"])) == 2  # seeds draw other discs and stones
        assert 0.0 < one["a"] < 1.0
        assert 0.0 <= one["theta"] < 180.0
        assert 100 < one["discs"] < 500
        assert one["seconds"] > 0.0
    assert by_case["printed"]["failure"] < by_case["calibrated"]["failure"]  # the paper's discs are the weaker soil
    assert by_case["continuum"]["discs"] == 0
    assert "## W6: " in page
    monkeypatch.setattr(w6.Study, "_run", lambda *_: pytest.fail("computed again"))
    assert w6.run(True, kept) == rows
