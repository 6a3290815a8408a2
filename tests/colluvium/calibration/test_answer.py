"""The answer of a calibration as plain data: parameters, goals, cost, seeds whose tests failed."""

import json

import pytest

from colluvium.calibration import answer
from colluvium.calibration.laboratory import Cost
from coupler_protocol.scene.reader import read_scene
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


def test_a_copy_in_another_folder_names_the_same_files(configs, tmp_path):
    source = tmp_path / "site" / "cutting.toml"
    source.parent.mkdir()
    stones = configs / "mapped_stones.geojson"
    (source.parent / "traced.geojson").write_bytes(stones.read_bytes())
    curve = '[[calibrate.curve]]\nfile = "{}"\nconfinement = 1e5\n'
    text = (configs / "mapped_stones.toml").read_text().replace('"mapped_stones.geojson"', '"traced.geojson"')
    source.write_text(text + curve.format("lab/100.csv") + curve.format(tmp_path / "200.csv"))
    target = tmp_path / "answers" / "fitted" / "copy.toml"
    answer.write_scene(source, [], {"soil": {"spring": {"normal": 4e7}}}, target)
    before, after = read_scene(source), read_scene(target)
    assert (after.stones.file, after.stones.file_hash) == (before.stones.file, before.stones.file_hash)
    assert after.discs.soil.spring.normal == 4e7
    near, far = (one.file for one in after.calibrate.curve)
    assert (target.parent / near).resolve() == source.parent / "lab" / "100.csv"
    assert far == str(tmp_path / "200.csv")
    assert "# path relative to the folder of this scene" in target.read_text()


def test_a_copy_beside_its_scene_keeps_the_text_of_paths(configs, tmp_path):
    source = tmp_path / "cutting.toml"
    source.write_text((configs / "mapped_stones.toml").read_text())
    answer.write_scene(source, [], {}, tmp_path / "copy.toml")
    assert (tmp_path / "copy.toml").read_text() == source.read_text()
