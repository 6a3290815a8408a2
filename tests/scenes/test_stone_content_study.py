"""configs/stone_content_study.toml: the calibrated slope, whose overload ends with its band."""

import pytest

from colluvium import open_run
from colluvium.forecast import check
from colluvium.results import failure
from coupler_protocol.scene.reader import read_scene
from tests.commands import run_colluvium

NAME = "stone_content_study.toml"


def test_window_and_stones_are_those_of_the_calibrated_slope(configs):
    scene, calibrated = (read_scene(configs / name) for name in (NAME, "calibrated_slope.toml"))
    for table in ("grid", "material", "window", "discs", "stones"):
        assert getattr(scene, table) == getattr(calibrated, table), table
    assert check.describe(scene)["doubts"] == []


@pytest.mark.long
def test_the_overload_ends_when_the_band_is_complete(configs, tmp_path):
    """With discs twice as large; seconds instead of minutes."""
    words = ["--out", tmp_path, "--in-process", "--quiet", "--set", "discs.radius=0.06", "--set", "stones.content=0.3"]
    done = run_colluvium("run", configs / NAME, *words)
    assert done.returncode == 0, done.stderr
    with open_run(tmp_path) as run:
        overload = run.info["stages"][-1]
        assert "band" in overload["ended_by"]
        assert overload["steps"] < 40000
        found = failure.summary(run)
    assert 7.5 < found["failed_at"] < 11.5
    assert found["crosses_window"]
