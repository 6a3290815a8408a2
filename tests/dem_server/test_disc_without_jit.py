"""The kernels mean the same with and without the compiler."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np

SCRIPT = """
import sys
import numpy as np
from window_case import SQUARE, soil_discs
from coupler_protocol.interface import build_ring
from window_case import rim
from dem_server.contacts import contact_forces
from dem_server.model import build_model
from dem_server.motion import move_free
from dem_server.balance import unbalanced_ratio
from dem_server.insitu import add_bonds
from dem_server.packing import Packing

ring = build_ring(rim(SQUARE), 0.1)
side = np.linspace(0.2, 0.8, 5)
xy = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2) + 0.01 * np.sin(np.arange(50.0)).reshape(25, 2)
model, state = build_model(ring.xy, ring.radius, Packing(xy, np.full(25, 0.078)), soil_discs(radius=0.078))
contact_forces(model, state)
for step in range(40):
    if step == 20:
        add_bonds(model, state)
    move_free(model, state, 9.81)
    contact_forces(model, state)
print(unbalanced_ratio(model, state, 9.81), state.builds, state.counters.tolist())
np.save(sys.argv[1], np.column_stack([state.disc, state.load, state.shear]))
"""


def run(tmp_path, disable):
    out = tmp_path / f"state{disable}.npy"
    environment = {"NUMBA_DISABLE_JIT": disable, "PYTHONPATH": str(Path(__file__).parent)}
    command = [sys.executable, "-c", SCRIPT, out]
    done = subprocess.run(command, env=os.environ | environment, capture_output=True, text=True, check=True)
    return done.stdout.split(), np.load(out)


def test_compiled_equals_interpreted(tmp_path):
    (ratio, *counts), plain = run(tmp_path, "1")
    (compiled_ratio, *compiled_counts), compiled = run(tmp_path, "0")
    assert counts == compiled_counts
    np.testing.assert_allclose(float(compiled_ratio), float(ratio), rtol=1e-9)
    scale = np.abs(plain).max(axis=0)
    assert (np.abs(compiled - plain) <= 1e-9 * scale).all()
    assert scale[:11].all()  # everything moved, and forces and moments act
