"""The answer of a calibration as plain data: parameters, goals, cost, seeds whose tests failed."""

import json

import pytest

from colluvium.calibration import answer
from colluvium.calibration.laboratory import Cost
from tests.colluvium.calibration.synthetic import Synthetic, scene_of, searched

TARGETS = {"young": 1e8, "poisson": 0.25, "cohesion": 1e4, "friction": 12.0}


class Spent(Synthetic):
    """A laboratory that counts its cost."""

    def __init__(self, *scatter, **more):
        super().__init__(*scatter, **more)
        self.used = {}

    def spent(self):
        return Cost(30, 200.0, 150.0)


@pytest.fixture(scope="module")
def found():
    laboratory = Spent(0.02, 0.005, fails=lambda values, seed: seed == 12)
    outcome, plan = searched(TARGETS, laboratory)
    return answer.found(plan, scene_of(TARGETS), outcome, laboratory, 99.0), outcome


def test_seeds_whose_tests_failed_are_named(found):
    data, outcome = found
    assert 12 not in data["seeds"]
    assert "without seeds 12" in data["words"][0]
    assert data["reached"] == (outcome.ended == "reached")
    assert any("30 tests" in line for line in data["words"])


def test_it_is_written_with_its_tables(found, tmp_path):
    data, outcome = found
    answer.write(data, tmp_path)
    again = json.loads((tmp_path / "answer.json").read_text())
    assert again["parameters"] == outcome.values
    assert (tmp_path / "discs.toml").read_text() == data["toml"]
    assert "[discs.soil]" in data["toml"]
