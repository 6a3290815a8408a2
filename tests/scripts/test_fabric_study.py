"""The study of fabrics on small packings: intervals contain the true values, those of independent contacts do not."""

import fabric_study
import numpy as np
import pytest

SEEDS = range(1, 17)


@pytest.fixture(scope="module")
def isotropic():
    """Numbers of small isotropic packings."""
    return fabric_study.measured(fabric_study.Case("small", 0.6), SEEDS)


def test_intervals_of_isotropic_packings(isotropic):
    """At least 13 of 16: fewer have a probability of 0.007 for intervals of 95 %."""
    for name in fabric_study.QUANTITIES:
        assert isotropic[name]["true"] == 0.0
        assert isotropic[name]["within"] >= 13 / 16
        assert isotropic[name]["isotropic"] == isotropic[name]["within"]


def test_directions_scatter_less_than_independent_contacts(isotropic):
    """About 0.5 to 0.6 of sqrt(2 / N), and forces about as much."""
    assert isotropic["a"]["scatter"] < 0.75
    assert isotropic["a_n"]["scatter"] > isotropic["a"]["scatter"]


def test_a_known_anisotropy():
    """A thinned packing has it exactly; the intervals contain it and its direction."""
    found = fabric_study.measured(fabric_study.Case("small", 0.6, thinned=0.5), SEEDS[:8])
    for name in fabric_study.QUANTITIES:
        assert found[name]["true"] == pytest.approx(0.5)
        assert found[name]["mean"] == pytest.approx(0.5, abs=0.1)
        assert found[name]["within"] >= 6 / 8
        assert found[name]["direction_within"] >= 6 / 8


def test_a_loaded_packing_has_more_contacts_along_the_load():
    free, loaded = (
        fabric_study.fabrics(fabric_study.Case("small", 0.6, bonded=True, stones=True, shortened=strain), 1)[0]
        for strain in (0.0, 0.004)
    )
    assert loaded.a_n > free.a_n
    assert abs(loaded.theta_n - 90.0) < 25.0
    assert not loaded.forces_isotropic


def test_a_line_of_the_table(isotropic):
    line = fabric_study.line_of(isotropic | {"case": "small"})
    assert len(line) == len(fabric_study.HEAD)
    assert line[2] == "0.00, 0.00"
    assert line[5] == "-"  # an isotropic packing has no direction


def test_shares_of_intervals_that_contain_a_vector():
    one = fabric_study.fit_fabric(np.linspace(0.0, 1.0, 50), np.ones(50))
    true = one.a * np.exp(2j * np.radians(one.theta_a + 0.5 * one.theta_a_error))
    assert fabric_study.within([one], "a", true) == (1.0, 1.0)
    assert fabric_study.within([one], "a", 3.0 * true) == (0.0, 1.0)
    assert fabric_study.within([one], "a", -true) == (1.0, 0.0)
