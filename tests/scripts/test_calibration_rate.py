"""scripts/studies/calibration_rate.py: the same samples at two rates, full and short tests apart."""

import json

import pytest

from colluvium.calibration import laboratory

calibration_rate = pytest.importorskip("calibration_rate")

VALUES = {"normal": 1e9, "ratio": 0.1, "friction": 0.15, "bond": 8e3}


@pytest.fixture
def without_runs(monkeypatch):
    """Steps of tests with a closed form: a slower one is 1 % softer, a short one 10 % stiffer, each seed 0.1 % more."""
    steps = {}

    def compute(self, values, tests, short):
        for test in tests:
            steps[test.pressure, test.seed, short, self.factor] = test.loading.steps
            young = 4e8 * (0.99 if self.factor < 1.0 else 1.0) * (1.1 if short else 1.0) * (1.0 + 0.001 * test.seed)
            numbers = {"E": young, "nu": 0.3, "peak_axial": 3e5 + test.pressure, "peak_side": test.pressure, "dilation": 20.0}
            key = laboratory.key_of(test)
            self.rows[key] = {
                "scene": key, "folder": test.name, "parameters": values, "sample": test.sample, "pressure": test.pressure,
                "seed": test.seed, "short": short, "answers": numbers | {"bonds_broken": 1.0},
            }  # fmt: skip

    monkeypatch.setattr(laboratory.SampleTests, "_compute", compute)
    return steps


def test_the_change_is_that_of_the_same_samples(without_runs, configs, tmp_path, capsys):
    (tmp_path / "answer.json").write_text(json.dumps({"parameters": VALUES}))
    words = [str(configs / "paper_slope.toml"), str(tmp_path / "answer.json"), "--out", str(tmp_path), "--seeds", "1", "2", "3"]
    calibration_rate.main([*words, "--json", str(tmp_path / "rates.json")])
    found = json.loads((tmp_path / "rates.json").read_text())
    for kind, factor in (("full", 1.0), ("short", 1.1)):
        young = next(row for row in found[kind]["rates"] if row["answer"] == "E")
        assert young["full"] == pytest.approx(4e8 * factor * 1.002)
        assert young["change"] == pytest.approx(-0.01 * young["full"])
        assert young["scatter"] == pytest.approx(4e5 * factor)
    said = capsys.readouterr().out
    assert "| full | E [MPa] | 400.8 | 396.8 | -4.0 | 0.4 |" in said
    assert "full tests: half the rate changes no answer by more than twice its scatter" in said  # 1 % counts as none
    for (pressure, seed, short, factor), count in without_runs.items():
        assert factor == 1.0 or count == pytest.approx(2 * without_runs[pressure, seed, short, 1.0], abs=1)
    assert len(without_runs) == 2 * 3 * (3 + 1)
