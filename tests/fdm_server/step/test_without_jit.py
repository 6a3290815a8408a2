"""The kernels mean the same with and without the compiler."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

SCRIPT = """
import sys
import numpy as np
from grid_cases import MohrCoulomb, material, slope, window
from fdm_server.step import clock
from fdm_server.step.zone_pass import advance
from fdm_server.effects.damping import Damping
from fdm_server.effects.rayleigh import RayleighTable
from fdm_server.effects.softening import Softening
from fdm_server.mesh.grid import build_grid
from fdm_server.observe.energy_ledger import Ledger
from fdm_server.ground.removed_zones import cut_window
from fdm_server.model import build_model, new_state
from fdm_server.step.gridpoint_pass import unbalanced_ratio, update_velocities
from fdm_server.step.present_shape import begin_large_strain
from fdm_server.mesh.window_zones import window_zones

scene = slope(2.0, [(0, 4), (4, 4), (12, 12), (20, 12)])
kind, strain = sys.argv[2].split()
softening = Softening(strain=[1e-4, 1e-3], cohesion=[1e3, 0.0], friction=[15, 12]) if kind == "softening" else None
scene.material[0] = material(mohr_coulomb=MohrCoulomb(friction=20, cohesion=2e3, dilation=5), softening=softening)
scene.damping = Damping(combined=0.5) if kind == "softening" else scene.damping
model = build_model(scene, build_grid(scene))
state = new_state(model)
if kind == "rayleigh":
    model = clock.begin(model, state, Damping(rayleigh=RayleighTable(fraction=0.1, frequency=50.0)), 0.5)
if strain == "large":
    begin_large_strain(model, state)
ledger = Ledger(model, state) if kind == "ledger" else None
values = {}
for step in range(40 if ledger else 60):
    if ledger:
        ledger.keep(state)
        update_velocities(model, state, 9.81)
        ledger.book_motion(model, state, 9.81)
        values = {f"energy_{name}": value for name, value in ledger.values(model, state).items()}
        advance(model, state)
        ledger.book_strain(model, state)
        continue
    if step == 40:
        mask = window_zones(model.grid, window((5, 6), (1, 2)))
        model, state, reaction = cut_window(model, state, mask)
        state.applied += reaction.under(9.81)
    update_velocities(model, state, 9.81)
    advance(model, state)
print(unbalanced_ratio(model, state, 9.81), np.count_nonzero(state.plastic))
arrays = {n: v for n in state.__slots__ if isinstance(v := getattr(state, n), np.ndarray | int | float)}
np.savez(sys.argv[1], **arrays, **values)
"""


def run(tmp_path, disable, case):
    out = tmp_path / f"state{disable}.npz"
    environment = {"NUMBA_DISABLE_JIT": disable, "PYTHONPATH": str(Path(__file__).parents[1])}
    command = [sys.executable, "-W", "ignore", "-c", SCRIPT, out, case]
    done = subprocess.run(command, env=os.environ | environment, capture_output=True, text=True, check=True)
    ratio, yielded = done.stdout.split()
    return float(ratio), int(yielded), np.load(out)


CASES = ["local small", "local large", "softening small", "softening large", "rayleigh small", "rayleigh large", "ledger small"]


@pytest.mark.parametrize("case", CASES)
def test_compiled_equals_interpreted(tmp_path, case):
    ratio, yielded, plain = run(tmp_path, "1", case)
    compiled_ratio, compiled_yielded, compiled = run(tmp_path, "0", case)
    assert ("mass" in plain.files) == ("large" in case)
    assert ("dt" in plain.files) == ("rayleigh" in case)
    assert ("plastic_shear" in plain.files) == ("softening" in case)
    assert ("energy_gravity" in plain.files) == ("ledger" in case)
    assert yielded > (0 if "rayleigh" in case else 10)
    assert yielded == compiled_yielded
    np.testing.assert_allclose(compiled_ratio, ratio, rtol=1e-12)
    for name in plain.files:
        scale = np.abs(plain["energy_gravity" if name == "energy_error" else name]).max()
        assert (np.abs(compiled[name] - plain[name]) <= 1e-12 * scale).all(), name
