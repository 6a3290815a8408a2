"""Shaking from a file: a layer on a half-space and on a rigid base by their transfer functions, and what is left afterwards.

The layer, of shear wave speed c and thickness H, is a column whose gridpoints move across only. With k H = w H/c and impedances
a = rho c / (rho c of the half-space), surface over outcrop of a compliant base:

    |F| = 1 / sqrt(cos^2 kH + a^2 sin^2 kH),        1/a at resonance, f = c/(4 H)

On a rigid base, surface over base: 1/|cos kH|, where Rayleigh damping C = r M + b K makes k^2 = (w^2 - i w r)/(c^2 (1 + i w b)).
Source: Kramer, S. L. (1996), Geotechnical Earthquake Engineering, section 7.2.
"""

import numpy as np
import pytest
from run_cases import column, compute, stage

from coupler_protocol.files import checkpoint
from fdm_server.effects.rayleigh import RayleighTable, parameters

H, ZONE, SPEED, RATIO = 15.0, 1.0, 100.0, 3.0  # RATIO: impedance of the half-space over that of the layer
SOFT = {"name": "layer", "density": 2000.0, "elastic": {"bulk": 2e7, "shear": 2000.0 * SPEED**2}}
ROCK = {
    "name": "half-space",
    "density": 2000.0,
    "elastic": {"bulk": 1e8, "shear": 2000.0 * (RATIO * SPEED) ** 2},
    "region": [[0.0, 0.0], [ZONE, 0.0], [ZONE, 2.0], [0.0, 2.0]],
}
SIDES = [{"on": side, "fix": "y"} for side in ("left", "right", "bottom")]
EVERY = 8  # steps between values


def wavelet(f, peak=0.1, step=0.01):
    """Rows of time and velocity of a Ricker wavelet with its largest amplitude at f [Hz]; it ends where it began."""
    time = np.arange(0.0, 3.0 / f + 0.5 * step, step)
    a = (np.pi * f * (time - 1.5 / f)) ** 2
    return np.column_stack([time, peak * (1.0 - 2.0 * a) * np.exp(-a)])


def write(path, rows, names="time,x"):
    np.savetxt(path, rows, delimiter=",", header=names, comments="", fmt="%.17g")
    return str(path)


def shaken(table, seconds, damping):
    """A stage in real time in which the bottom shakes."""
    real = stage("shake", time="real", damping=damping, boundary=[{"on": "bottom", "shaking": table}, SIDES[2]])
    return real | {"until": {"time": seconds}, "step_factor": 0.9}


def motion(out, table, seconds, damping, materials, height):
    """Times [s] and velocities [m/s] of the top and of the bottom in x."""
    seen = []

    def look(moment):
        seen.append((moment.state.dt, moment.state.velocity[-1, 0], moment.state.velocity[0, 0]))

    real, grid = shaken(table, seconds, damping), column(ZONE, height, ZONE)
    with compute(out / "run", grid, real, boundary=SIDES, material=materials, on_step=(EVERY, look)):
        dt, top, bottom = np.array(seen).T
    assert np.ptp(dt) == 0.0
    return (np.arange(len(dt)) * EVERY + EVERY - 0.5) * dt[0], top, bottom


def spectrum(time, values, frequencies):
    """Fourier integrals of values at even times."""
    return np.exp(-2j * np.pi * np.outer(frequencies, time)) @ values * (time[1] - time[0])


def test_a_layer_on_a_compliant_base_amplifies_by_its_transfer_function(tmp_path):
    rows = wavelet(2.5)
    table = {"file": write(tmp_path / "base.csv", rows), "base": "compliant", "x": 2.0}
    time, top, _ = motion(tmp_path, table, 5.5, {"local": 0.0}, (SOFT, ROCK), H + 2.0)
    f = np.array([0.75, 1.25, SPEED / (4.0 * H), 2.0, 3.0])
    dense = np.arange(0.0, rows[-1, 0], 0.002)
    arrives = spectrum(dense, 2.0 * np.interp(dense, *rows.T), f)
    kh = 2.0 * np.pi * f * H / SPEED
    expected = 1.0 / np.sqrt(np.cos(kh) ** 2 + (np.sin(kh) / RATIO) ** 2)
    assert expected[2] == pytest.approx(RATIO)
    np.testing.assert_allclose(np.abs(spectrum(time, top, f)) / np.abs(2.0 * arrives), expected, rtol=0.01)


@pytest.mark.parametrize("part", ["both", *(pytest.param(part, marks=pytest.mark.long) for part in ("mass", "stiffness"))])
def test_a_damped_layer_on_a_rigid_base_amplifies_by_its_transfer_function(tmp_path, part):
    rows = wavelet(2.5)
    table = {"file": write(tmp_path / "base.csv", rows), "base": "rigid", "x": 1.0}
    damping = {"rayleigh": {"fraction": 0.1, "frequency": SPEED / (4.0 * H), "part": part}}
    time, top, bottom = motion(tmp_path, table, 6.5, damping, (SOFT,), H)
    f = np.array([1.0, SPEED / (4.0 * H), 2.5, 3.0])
    w, law = 2.0 * np.pi * f, parameters(RayleighTable(**damping["rayleigh"]))
    k = np.sqrt((w**2 - 1j * w * (law.mass or 0.0)) / (SPEED**2 * (1.0 + 1j * w * (law.stiffness or 0.0))))
    amplified = np.abs(spectrum(time, top, f)) / np.abs(spectrum(time, bottom, f))
    np.testing.assert_allclose(amplified, 1.0 / np.abs(np.cos(k * H)), rtol=0.01)


@pytest.mark.parametrize("base", ["rigid", "compliant"])
def test_motion_ends_with_its_stage_and_the_ground_comes_to_rest(tmp_path, base):
    """The file stops in the middle of its motion. Afterwards a rigid base keeps its place, and no wave arrives any more."""
    rows = np.array([[0.0, 0.0], [0.1, 0.1], [1.0, 0.1]])
    table = {"file": write(tmp_path / "base.csv", rows), "base": base, "x": 1.0}
    rest = stage("rest", time="real", damping={"local": 0.0}) | {"until": {"time": 1.0}}
    stages = shaken(table, 0.5, {"local": 0.0}), rest
    with compute(tmp_path / "run", column(ZONE, 5.0, ZONE), *stages, boundary=SIDES, material=(SOFT,)) as run:
        path = run.history("moved_x:bottom")[1] if base == "rigid" else None
    moving, still = (checkpoint.load(tmp_path / "run" / f"fdm.rank0.{name}.h5")[0]["grid"] for name in ("shake", "rest"))
    if base == "rigid":
        assert path[-1] == pytest.approx(0.1 * (0.5 - 0.1 / 2), rel=0.01)
        np.testing.assert_array_equal(still["displacement"][:2, 0], moving["displacement"][:2, 0])
    else:
        assert np.abs(moving["velocity"]).max() > 0.1
        assert np.abs(still["velocity"]).max() < 0.03 * np.abs(moving["velocity"]).max()
    assert not any(name.endswith("arriving") for name in moving.get("loads", {}))
