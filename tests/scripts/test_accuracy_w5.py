"""scripts/accuracy_cost.py W5: a uniform stress through the interface."""

import pytest

from tests.scripts.workload import computed

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """(rows, page) of the fast run."""
    return computed("W5", tmp_path_factory.mktemp("w5"))


def curve(found, case, method):
    rows = [row for row in found[0] if row["case"] == case and row["method"] == method]
    assert len(rows) >= 2
    return {row["per_segment"]: row for row in rows}


def test_what_corners_lack_halves_with_the_radius(found):
    lattice = curve(found, "lattice", "on the segment, work-consistent")
    assert 0.9 < lattice[1]["order"] < 1.3
    assert 0.9 < lattice[1]["traction_order"] < 1.3
    assert lattice[4]["error"] == pytest.approx(0.5 * lattice[2]["error"], rel=0.05)


def test_the_work_consistent_mapping_loses_neither_moment_nor_power_wherever_discs_stand(found):
    for case in ("lattice", "packing"):
        for place in ("on the segment", "R outside"):
            for row in curve(found, case, f"{place}, work-consistent").values():
                assert max(row["moment"], row["power"]) < 1e-14


def test_the_papers_mapping_loses_moment_everywhere_and_power_off_the_segments(found):
    for case in ("lattice", "packing"):
        on, off = (curve(found, case, f"{place}, paper") for place in ("on the segment", "R outside"))
        assert all(row["moment"] > 0.03 for row in (*on.values(), *off.values()))
        assert all(row["power"] < 1e-14 for row in on.values())
        assert all(row["power"] > 0.02 for row in off.values())
        assert on[4]["moment"] < 0.6 * on[2]["moment"]


def test_an_offset_hardly_changes_the_stress_with_the_work_consistent_mapping(found):
    on, off = (curve(found, "lattice", f"{place}, work-consistent") for place in ("on the segment", "R outside"))
    for size, row in off.items():
        assert row["traction"] == pytest.approx(on[size]["traction"], rel=0.1)
        assert row["traction"] < 0.8 * curve(found, "lattice", "R outside, paper")[size]["traction"]


def test_grain_of_a_packing_comes_in_addition(found):
    lattice, packing = (curve(found, case, "on the segment, work-consistent") for case in ("lattice", "packing"))
    assert all(packing[size]["traction"] > lattice[size]["traction"] for size in (2, 4))
    assert packing[4]["traction"] < 0.6 * packing[2]["traction"]
