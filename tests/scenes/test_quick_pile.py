"""configs/quick_pile.toml from the command line: a pile of discs without a grid, gone on with from its collapse."""

import numpy as np
import pytest

from colluvium import open_run
from tests.commands import run_colluvium


@pytest.fixture(scope="module")
def pile(tmp_path_factory, configs):
    out = tmp_path_factory.mktemp("pile") / "run"
    done = run_colluvium("run", configs / "quick_pile.toml", "--out", out, "--in-process", "--quiet")
    assert done.returncode == 0, done.stderr
    return out


def test_check_says_what_it_is(configs):
    done = run_colluvium("check", configs / "quick_pile.toml")
    assert done.returncode == 0, done.stderr
    assert "discs alone" in done.stdout
    assert "real time" in done.stdout


def test_the_pile(pile):
    """It spreads over the ground to the right of the wall and rests on it with its weight."""
    with open_run(pile) as run:
        assert run.info["stages"][1]["seconds_simulated"] == pytest.approx(1.0, rel=1e-4)
        assert run.info["stages"][2]["ended_by"].startswith("ratio")
        discs = run.discs(-1)
        x, y = discs.xy.T
        assert x.max() > 1.5
        assert y.max() < 1.2
        assert (y > 0.9 * discs.radius).all()
        assert (x > 0.9 * discs.radius).all()
        weight = 2000.0 * np.pi * (discs.radius**2).sum() * 9.81
        assert run.history("wall_force_y", 1)[1][-1] == pytest.approx(-weight, rel=2e-3)
        steps, kinetic = run.history("kinetic_energy", 1)
        fallen = run.history("weight_energy", 1)[1]
        collapse = steps <= run.frames[run.last_frame("collapse")].step
        assert (kinetic + fallen)[collapse].max() < 1.02 * (kinetic + fallen)[0]  # energy is lost, not gained


def test_a_run_goes_on_from_a_stage(pile, configs, tmp_path):
    words = ["--from", f"{pile}@collapse", "--in-process", "--quiet", "--set", "stage.2.until={steps=100}"]
    done = run_colluvium("run", configs / "quick_pile.toml", "--out", tmp_path / "b", *words)
    assert done.returncode == 0, done.stderr
    with open_run(tmp_path / "b") as run:
        assert run.info["stages"][-1]["steps"] == 100


@pytest.mark.long
def test_its_report(pile, tmp_path):
    done = run_colluvium("report", pile, "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "report.html").exists()
    assert (tmp_path / "force_chains.png").exists()
