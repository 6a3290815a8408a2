"""The energy ledger names what dashpots take and what arriving waves bring.

A wave v(t) that arrives at a compliant base of ground with the impedance rho c brings, per area, rho c times the integral of v^2;
its forces do twice this work, and the dashpots take half of it back. A pulse that leaves through
a quiet side leaves its energy there.
"""

import numpy as np
import pytest
from run_cases import SOIL, column, compute, stage
from test_shaking import wavelet, write

HEIGHT, WIDTH = 40.0, 0.5
Z = np.sqrt(2000.0 * 0.15e9)  # rho cS [Pa s/m]
SIDES = [{"on": side, "fix": "y"} for side in ("left", "right")]
REAL = {"time": "real", "damping": {"local": 0.0}}
RECORD = {"record": {"every": 100_000, "history": 10, "energy": True}}


def histories(run, *names):
    return [run.history(f"energy_{name}")[1] for name in names]


def test_a_wave_that_arrives_brings_its_energy(tmp_path):
    """Until it comes back from the surface; the ledger closes to round-off."""
    rows = wavelet(25.0, step=1e-3)
    table = {"file": write(tmp_path / "base.csv", rows), "base": "compliant", "x": 1.0}
    shake = stage("shake", boundary=[{"on": "bottom", "shaking": table}], **REAL) | {"until": {"time": 0.13}}
    with compute(tmp_path / "run", column(WIDTH, HEIGHT, 0.25), shake, boundary=SIDES, **RECORD) as run:
        arriving, dashpots, kinetic, strain, external, error = histories(
            run, "arriving", "dashpots", "kinetic", "strain", "external", "error"
        )
    dense = np.linspace(0.0, rows[-1, 0], 20001)
    brought = Z * np.trapezoid(np.interp(dense, *rows.T) ** 2, dense) * WIDTH
    assert kinetic[-1] + strain[-1] == pytest.approx(brought, rel=0.01)
    assert arriving[-1] == pytest.approx(2.0 * brought, rel=0.01)
    assert dashpots[-1] == pytest.approx(brought, rel=0.02)  # their forces are half a step late
    assert np.abs(external).max() < 1e-9 * brought
    assert np.abs(error).max() < 1e-12 * brought


@pytest.mark.parametrize("axis", ["x", "y"])
def test_a_pulse_leaves_its_energy_in_the_dashpots(tmp_path, axis):
    still = {"x": 0.0, "y": 0.0}
    top = {"on": "top", "velocity": still | {axis: -0.01}, "over": 120}
    base = [{"on": side, "fix": "x" if axis == "y" else "y"} for side in ("left", "right")]
    quiet = {"on": "bottom", "quiet": True}
    stages = (
        stage("push", steps=120, boundary=[top, quiet], **REAL),
        stage("ease", steps=120, boundary=[top | {"velocity": still}], **REAL),
        stage("run", steps=900 if axis == "y" else 1800, **REAL),
    )
    with compute(tmp_path, column(WIDTH, HEIGHT, 0.5), *stages, boundary=base, **RECORD) as run:
        steps, dashpots = run.history("energy_dashpots")
        _, kinetic = run.history("energy_kinetic")
        _, strain = run.history("energy_strain")
        _, error = run.history("energy_error")
        begin = np.searchsorted(steps, 241)
    whole = kinetic[begin] + strain[begin]
    assert dashpots[-1] == pytest.approx(whole, rel=2e-3)
    assert kinetic[-1] + strain[-1] < 2e-3 * whole
    assert np.abs(error).max() < 1e-12 * whole


def test_a_scene_without_quiet_sides_has_no_such_terms(tmp_path):
    with compute(tmp_path, column(2.0, 2.0), stage("rest", steps=50), material=(SOIL,), **RECORD) as run:
        names = run.histories(0)
    assert "energy_external" in names
    assert not {"energy_dashpots", "energy_arriving"} & set(names)
