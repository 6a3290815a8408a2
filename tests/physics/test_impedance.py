"""Waves that meet other ground: a share (Z1 - Z2)/(Z1 + Z2) comes back, 2 Z1/(Z1 + Z2) goes on, Z = rho c of P or S waves.

A wavelet arrives at the compliant base of a column, which is other ground from 60 m on: denser, stiffer, or both.
Source: Achenbach (1973), Wave Propagation in Elastic Solids, section 3.3.
"""

import numpy as np
import pytest
from run_cases import column, compute, stage
from test_shaking import wavelet, write

ZONE, HEIGHT, MIDDLE = 0.5, 160.0, 60.0
FREQUENCY = 20.0  # [Hz] of S waves, of P waves with the same length
K, G, DENSITY = 3.2e8, 1.5e8, 2000.0
MODULUS = {"x": G, "y": K + 4.0 * G / 3.0}
UPPER = [[0.0, MIDDLE], [ZONE, MIDDLE], [ZONE, HEIGHT], [0.0, HEIGHT]]


def ground(name, density, stiffness, **more):
    return {"name": name, "density": density, "elastic": {"bulk": stiffness * K, "shear": stiffness * G}} | more


def shares(out, axis, density, stiffness):
    """Amplitudes of what comes back and goes on over those that arrive, at half, one and 1.5 times the frequency."""
    c, f = np.sqrt(MODULUS[axis] / DENSITY), FREQUENCY * (1.0 if axis == "x" else np.sqrt(MODULUS["y"] / MODULUS["x"]))
    rows = wavelet(f, 1.0, 2e-2 / f)
    table = {"file": write(out / "base.csv", rows, f"time,{axis}"), "base": "compliant", axis: 1.0}
    held = [{"on": side, "fix": "y" if axis == "x" else "x"} for side in ("left", "right")]
    seen = []

    def look(moment):
        line = moment.state.velocity[::2, "xy".index(axis)]
        seen.append((moment.state.dt, line[60], line[180]))  # 30 m below the boundary and above it

    shake = stage("shake", time="real", damping={"local": 0.0}, boundary=[{"on": "bottom", "shaking": table}])
    faster = np.sqrt(stiffness / density)
    shake |= {"until": {"time": rows[-1, 0] + 90.0 / c + 5.0 / c}, "step_factor": 0.5}
    upper = ground("upper", density * DENSITY, stiffness, region=UPPER)
    lower = ground("lower", DENSITY, 1.0)
    with compute(out / "run", column(ZONE, HEIGHT, ZONE), shake, boundary=held, material=(lower, upper), on_step=(1, look)):
        dt, below, above = np.array(seen).T
    time = np.cumsum(dt)
    passed = rows[-1, 0] + 30.0 / c  # at 30 m; what comes back arrives there at 90 m/c
    assert passed < 80.0 / c
    onward = time < 60.0 / c + 30.0 / (faster * c) + rows[-1, 0]
    at = f * np.array([0.5, 1.0, 1.5])
    arrives, back, on = (
        np.exp(-2j * np.pi * np.outer(at, time[part])) @ values[part]
        for part, values in ((time <= passed, below), (time > passed, below), (onward, above))
    )
    sign = np.sign(below[time > passed][np.abs(below[time > passed]).argmax()])
    return sign * np.abs(back / arrives), np.abs(on / arrives)


@pytest.mark.parametrize("axis", ["x", "y"])
@pytest.mark.parametrize(
    ("density", "stiffness"),
    [(1.0, 1.0), (2.0, 2.0), (1.0, 4.0), (2.0, 8.0), (0.25, 0.25)],
    ids=["1", "2", "2, faster", "4", "1/4"],
)
def test_a_wave_is_reflected_and_goes_on_by_the_impedances(tmp_path, axis, density, stiffness):
    ratio = np.sqrt(density * stiffness)
    back, on = shares(tmp_path, axis, density, stiffness)
    np.testing.assert_allclose(back, (1.0 - ratio) / (1.0 + ratio), atol=0.01)
    np.testing.assert_allclose(on, 2.0 / (1.0 + ratio), atol=0.01)
