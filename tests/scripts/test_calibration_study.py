"""scripts/studies/calibration_study.py: values around an answer, lines through strengths, pictures."""

import json

import pytest

from colluvium.calibration.targets import deviator, strength_name
from tests.colluvium.calibration.synthetic import PRESSURES

calibration_study = pytest.importorskip("calibration_study")

VALUES = {"normal": 1e9, "ratio": 0.1, "friction": 0.15, "bond": 8e3}


def answers(cohesion, friction):
    """Answers of a sample with this strength."""
    return {"young": 4e8, "poisson": 0.33} | {strength_name(p): deviator(cohesion, friction, p) for p in PRESSURES}


def test_cohesion_and_friction_of_the_samples():
    found = calibration_study.summary({1: answers(5e4, 30.0), 2: answers(4e4, 28.0)}, PRESSURES)
    assert found["c"]["mean"] == pytest.approx(4.5e4)
    assert found["phi"]["mean"] == pytest.approx(29.0)
    assert found["phi"]["sd"] == pytest.approx(2.0**0.5)
    assert found["E"] == {"mean": 4e8, "sd": 0.0}


class Fake:
    """Tests without a run: friction gives the friction angle, all else nothing."""

    def __init__(self, scene, *_):
        self.scene = scene

    def measure(self, values, seeds, short):
        assert not short
        return {seed: answers(5e4, 20.0 + 40.0 * values["friction"] + seed) for seed in seeds}


def test_rows_and_pictures(tmp_path, monkeypatch, configs):
    pytest.importorskip("matplotlib")
    monkeypatch.setattr(calibration_study, "SampleTests", Fake)
    (tmp_path / "answer.json").write_text(json.dumps({"parameters": VALUES}))
    words = [str(configs / "paper_slope.toml"), str(tmp_path / "answer.json"), "--only", "friction", "rolling", "radius"]
    calibration_study.main([*words, "--out", str(tmp_path), "--json", str(tmp_path / "rows.json"), "--pictures", str(tmp_path)])
    rows = json.loads((tmp_path / "rows.json").read_text())
    mu = {row["value"]: row["phi"]["mean"] for row in rows if row["name"] == "friction"}
    assert mu == pytest.approx({0.075: 24.5, 0.15: 27.5, 0.45: 39.5}, abs=0.01)
    assert [row["value"] for row in rows if row["name"] == "radius"] == [0.02, 0.03, 0.05]
    assert [row["answer"] for row in rows if row["name"] == "friction"] == [False, True, False]
    for name in ("friction", "rolling", "radius"):
        assert (tmp_path / f"calibration_{name}.png").stat().st_size > 5000


def test_the_gap_of_bonds_keeps_its_share_of_the_radius(configs):
    scene = calibration_study.with_table(calibration_study.read_scene(configs / "calibrated_slope.toml"))
    share = scene.lab.bond_gap / scene.discs.radius
    words = calibration_study.changes("radius", 0.05, scene)
    other = calibration_study.read_scene(configs / "calibrated_slope.toml", words)
    assert other.discs.radius == 0.05
    assert other.lab.bond_gap / other.discs.radius == pytest.approx(share)
    assert calibration_study.changes("content", 0.2, scene) == ["stones.content=0.2"]
