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
from window_case import SQUARE, soil_discs, stone_grain, stones_table
from coupler_protocol.interface import build_ring
from window_case import rim
from dem_server.contacts import contact_forces
from dem_server.model import build_model
from dem_server.motion import move_free
from dem_server.balance import unbalanced_ratio
from dem_server.insitu import add_bonds
from dem_server.packing import Packing
from dem_server import energy, mesostructure, stones

ring = build_ring(rim(SQUARE), 0.1)
side = np.linspace(0.2, 0.8, 5)
xy = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2) + 0.01 * np.sin(np.arange(50.0)).reshape(25, 2)
model, state = build_model(ring.xy, ring.radius, Packing(xy, np.full(25, 0.078)), soil_discs(radius=0.078, stone=stone_grain()))
contact_forces(model, state)
for step in range(40):
    if step == 20:
        found = mesostructure.draw(SQUARE, stones_table(content=float(sys.argv[2]), gap=0.0), np.random.default_rng(1))
        stones.mark(model, state, found.outlines, 2700.0)
        model = stones.make(model, state, found.outlines, "clump")
        add_bonds(model, state)
    move_free(model, state, 9.81)
    contact_forces(model, state)
print(unbalanced_ratio(model, state, 9.81), found.sweeps, state.builds, state.counters.tolist())
np.save(sys.argv[1], np.column_stack([state.disc, state.load, state.shear]))
np.save(sys.argv[3], state.clumps.motion)
"""


def run(tmp_path, disable, content):
    out, bodies = tmp_path / f"state{disable}.npy", tmp_path / f"bodies{disable}.npy"
    environment = {"NUMBA_DISABLE_JIT": disable, "PYTHONPATH": str(Path(__file__).parent)}
    command = [sys.executable, "-c", SCRIPT, out, content, bodies]
    done = subprocess.run(command, env=os.environ | environment, capture_output=True, text=True, check=True)
    return done.stdout.split(), np.load(out), np.load(bodies)


@pytest.mark.parametrize("content", ["0.3", "0.5"], ids=["largest first", "grown"])
def test_compiled_equals_interpreted(tmp_path, content):
    (ratio, *counts), plain, bodies = run(tmp_path, "1", content)
    (compiled_ratio, *compiled_counts), compiled, compiled_bodies = run(tmp_path, "0", content)
    assert counts == compiled_counts
    np.testing.assert_allclose(float(compiled_ratio), float(ratio), rtol=1e-9)
    scale = np.abs(plain).max(axis=0)
    assert (np.abs(compiled - plain) <= 1e-9 * scale).all()
    np.testing.assert_allclose(compiled_bodies, bodies, rtol=1e-9, atol=1e-9 * np.abs(bodies[:, :5]).max())
    assert bodies[:, 4].any()
    assert scale[:11].all()  # everything moved, and forces and moments act
