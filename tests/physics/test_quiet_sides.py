"""Quiet sides: a pulse that runs into one does not come back; what held the side before still does."""

import numpy as np
import pytest
from run_cases import ROLLERS, column, compute, stage

from coupler_protocol.files import checkpoint

LENGTH = 40.0
SPEEDS = {"y": np.sqrt((0.5e9 + 4 / 3 * 0.15e9) / 2000.0), "x": np.sqrt(0.15e9 / 2000.0)}  # of P and S waves [m/s]


def real(name, steps, **more):
    return stage(name, steps=steps, time="real", damping={"local": 0.0}, **more)


def left_after(out, axis, *quiet):
    """Kinetic energy over its largest one, after a pulse of motion along the axis from the top has had time to come back."""
    still = {"x": 0.0, "y": 0.0}
    wave, rise = SPEEDS[axis], 120 if axis == "y" else 260  # pulses of 40 zones
    top = {"on": "top", "velocity": still | {axis: -0.01}, "over": rise}
    base = [{"on": side, "fix": "x" if axis == "y" else "y"} for side in ("left", "right")]
    with compute(
        out,
        column(0.5, LENGTH, 0.5),
        real("push", rise, boundary=[top, *quiet]),
        real("ease", rise, boundary=[top | {"velocity": still}]),
        real("run", 700 if axis == "y" else 1500),
        boundary=[*base, {"on": "bottom", "fix": "xy"}],
    ) as run:
        energy = run.history("kinetic_energy")[1]
        seconds = run.history("time")[1]
    assert seconds[-1] * wave > 1.5 * LENGTH
    return energy[-1] / energy.max()


@pytest.mark.parametrize("axis", SPEEDS)
def test_a_pulse_leaves(tmp_path, axis):
    assert left_after(tmp_path / "fixed", axis) > 0.4
    assert left_after(tmp_path / "quiet", axis, {"on": "bottom", "quiet": True}) < 5e-4  # 2.2 % of the velocity


def test_the_ground_stays_at_rest_on_a_side_that_becomes_quiet(tmp_path):
    sides = [{"on": "bottom", "quiet": True}, {"on": "left", "quiet": True}]
    with compute(
        tmp_path,
        column(4.0, 4.0),
        stage("rest", "equilibrium", ratio=1e-10, gravity=9.81),
        real("wait", 200, boundary=sides),
        boundary=ROLLERS,
    ) as run:
        assert run.history("max_displacement")[1][-1] < 1e-10
    held = checkpoint.load(tmp_path / "fdm.rank0.wait.h5")[0]["grid"]["applied"]
    assert held[:, 1].sum() == pytest.approx(2000.0 * 9.81 * 16.0, rel=1e-7)
