"""scripts/accuracy_cost.py W2: curves of the factors of safety."""

import pytest

from tests.scripts.workload import computed

pytestmark = [pytest.mark.long, pytest.mark.trial]


@pytest.fixture(scope="module")
def rows(tmp_path_factory):
    """(rows, page) of the fast run."""
    return computed("W2", tmp_path_factory.mktemp("w2"))


def curve(rows, case, method):
    return [row for row in rows if row["case"] == case and row["method"].startswith(method)]


def test_smaller_zones_are_better_and_columns_along_the_face_best(rows):
    along = curve(rows[0], "Dawson", "zone size, columns")
    cut = curve(rows[0], "Dawson", "zone size, triangles")
    for found in (along, cut):
        assert [r["error"] for r in found] == sorted((r["error"] for r in found), reverse=True)
        assert 0.7 < found[0]["order"] < 1.6
    by_size = {r["parameter"]: r["error"] for r in along}
    assert all(by_size[r["parameter"]] < r["error"] for r in cut if r["parameter"] in by_size)


def test_extrapolation_beats_every_mesh_it_comes_from(rows):
    (limit,) = curve(rows[0], "Dawson", "extrapolated, columns")
    assert limit["error"] < 0.01 < min(r["error"] for r in curve(rows[0], "Dawson", "zone size, columns"))
    assert limit["to_one_percent"] == limit["seconds"]


@pytest.mark.parametrize("case", ["Griffiths-Lane", "paper slope"])
def test_slopes_without_a_reference_go_to_a_limit_with_their_zones(rows, case):
    found = curve(rows[0], case, "zone size, columns")
    assert [r["value"] for r in found] == sorted((r["value"] for r in found), reverse=True)
    assert 0.6 < found[0]["order"] < 1.6
    assert 0.0 < found[-1]["gci"] < 0.1


def test_narrower_brackets_are_narrower_and_dearer(rows):
    found = curve(rows[0], "Dawson", "bracket")
    assert [r["error"] for r in found] == sorted((r["error"] for r in found), reverse=True)
    assert [r["trials"] for r in found] == sorted(r["trials"] for r in found)


def test_a_larger_budget_does_not_widen_the_bracket(rows):
    small, large = curve(rows[0], "Dawson", "budget")
    assert small["parameter"] < large["parameter"]
    assert large["error"] <= small["error"]


def test_the_section_says_how_to_read_it(rows):
    assert "## W2: " in rows[1]
    assert "Halving the zones halves the error" in rows[1]
    assert "limit analysis" in rows[1]
