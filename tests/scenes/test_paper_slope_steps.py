"""configs/paper_slope_steps.toml: every stage begins and ends; the first is held at rest. Later ones are cut short here."""

import pytest

from colluvium import open_run
from tests.commands import run_colluvium

pytestmark = pytest.mark.long


def test_five_g_is_borne(tmp_path, configs):
    short = [word for i in range(4, 9) for word in ("--set", f"stage.{i}.until.steps=40")]
    words = ["run", configs / "paper_slope_steps.toml", "--out", tmp_path / "run", "--quiet", *short]
    done = run_colluvium(*words)
    assert done.returncode == 0, done.stderr
    with open_run(tmp_path / "run") as run:
        rows = {row["name"]: row for row in run.info["stages"]}
        assert rows["5 g"]["ended_by"].startswith("ratio")
        assert rows["5 g"]["gravity_factor"] == 5.0
        assert max(rows["5 g"]["ratio_discrete"]) <= 2e-5  # of the stage's last step, after the looks that ended it
        assert run.info["band"]["failed_at"] is None
        assert rows["10 g"]["steps"] == 40
        assert rows["10 g"]["gravity_factor"] == pytest.approx(5.292, abs=1e-3)  # 40 steps of each ramp in turn
        crest = run.history("max_displacement")[1]
        assert 0.005 < crest[-1] < 0.1  # [m]
