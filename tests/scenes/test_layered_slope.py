"""configs/layered_slope.toml: at rest under its weight, then under a load upon its crest."""

import numpy as np
import pytest

from colluvium import open_run
from tests.commands import run_colluvium

PROFILE = [[0.0, 8.0, 13.0, 15.5, 18.0, 34.0], [5.0, 5.0, 9.2, 9.2, 13.0, 13.0]]


def test_the_bottom_carries_what_lies_on_it(tmp_path, configs):
    done = run_colluvium("run", configs / "layered_slope.toml", "--out", tmp_path, "--in-process", "--quiet")
    assert done.returncode == 0, done.stderr
    with open_run(tmp_path) as run:
        rest, load = run.info["stages"]
        group, xy, moved = run.zones(-1).group, run.gridpoints(-1).xy, run.gridpoints(-1).displacement
    assert rest["ended_by"].startswith("ratio")
    assert load["ended_by"].startswith("ratio")
    rock = np.trapezoid([2.0, 3.0, 6.0], [0.0, 20.0, 34.0])
    weight = 9.81 * (2000.0 * np.trapezoid(PROFILE[1], PROFILE[0]) + 500.0 * rock)
    assert rest["reactions"]["bottom"]["y"] == pytest.approx(weight, rel=1e-4)
    assert load["reactions"]["bottom"]["y"] - rest["reactions"]["bottom"]["y"] == pytest.approx(200e3, rel=1e-3)
    assert set(group) == {0, 1}
    below = (np.abs(xy[:, 0] - 24.0) < 1.0) & (xy[:, 1] == 13.0)
    assert moved[below, 1].max() < -2e-3
    assert np.abs(moved[xy[:, 0] < 8.0]).max() < 2e-4
