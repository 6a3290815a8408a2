"""configs/quick_shaking.toml from the command line: a layer at resonance amplifies by the ratio of impedances."""

import numpy as np
import pytest

from colluvium import open_run
from tests.commands import run_colluvium

RATIO, OUTCROP = 3.0, 2.0 * 0.05  # impedance of rock over that of the layer; velocity of rock at the surface [m/s]


def test_the_surface_moves_three_times_as_much_as_rock(tmp_path, configs):
    done = run_colluvium("run", configs / "quick_shaking.toml", "--out", tmp_path, "--in-process", "--quiet")
    assert done.returncode == 0, done.stderr
    with open_run(tmp_path) as run:
        top = np.array([run.gridpoints(frame).velocity[-1] for frame in range(len(run.frames))])
        error, kinetic = (np.abs(run.history(f"energy_{name}")[1]) for name in ("error", "kinetic"))
    assert np.abs(top[:, 0]).max() / OUTCROP == pytest.approx(RATIO, rel=0.01)
    assert np.abs(top[:, 1]).max() < 1e-9
    assert error.max() < 1e-9 * kinetic.max()
    assert kinetic[-1] < 0.01 * kinetic.max()  # the waves have left through the base
