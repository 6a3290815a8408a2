"""The kernels mean the same with and without the compiler."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytestmark = pytest.mark.long

SCRIPT = """
import sys
import numpy as np
from window_case import SQUARE, soil_discs, stone_grain, stones_table
from coupler_protocol.interface.ring import build_ring
from window_case import rim
from dem_server.step.contact_pass import contact_forces
from dem_server.model import build_model
from dem_server.step.motion import move_free
from dem_server.observe.unbalanced_ratio import unbalanced_ratio
from dem_server.step.bonds_made import add_bonds
from dem_server.packing.packing import Packing
from dem_server.observe import energy
from dem_server.stones import mesostructure
from dem_server.stones import bodies as stones

ring = build_ring(rim(SQUARE), 0.1)
side = np.linspace(0.2, 0.8, 5)
xy = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2) + 0.01 * np.sin(np.arange(50.0)).reshape(25, 2)
model, state = build_model(ring.xy, ring.radius, Packing(xy, np.full(25, 0.078)), soil_discs(radius=0.078, stone=stone_grain()))
contact_forces(model, state)
for step in range(40):
    if step == 20:
        found = mesostructure.draw(SQUARE, stones_table(content=float(sys.argv[2]), gap=0.0), np.random.default_rng(1))
        stones.assign_discs(model, state, found.outlines, 2700.0)
        model = stones.form_stones(model, state, found.outlines, "clump")
        add_bonds(model, state)
    move_free(model, state, 9.81)
    contact_forces(model, state)
print(unbalanced_ratio(model, state, 9.81), found.sweeps, state.builds, state.counters.tolist())
np.savez(sys.argv[1], discs=np.column_stack([state.disc, state.load]), pairs=state.shear[:, None])
np.save(sys.argv[3], state.clumps.motion)
"""


ALL_LAWS = """
import sys
import numpy as np
from disc_cases import loose_discs
from dem_server.observe import unbalanced_ratio as balance
from dem_server.step import cycle
from dem_server.observe import energy
from dem_server.step.bonds_made import add_parallel_bonds
from dem_server.effects.dashpot import Dashpot
from dem_server.effects.parallel_bond import ParallelBond
from dem_server.effects.rolling import Rolling
from dem_server.step.walls import make_walls

xy = np.stack(np.meshgrid(np.arange(4.0), np.arange(3.0)), axis=-1).reshape(-1, 2) * 0.0595
cement = ParallelBond(normal_stiffness=1e9, shear_stiffness=5e8, tension=1.2e5, shear=2e5, radius=0.8)
model, state = loose_discs(xy, np.full(12, 0.03), True, rolling=Rolling(coefficient=0.2),
                           dashpot=Dashpot(normal=0.2, shear=0.1), parallel_bond=cement)
add_parallel_bonds(model, state)
rng = np.random.default_rng(3)
static, fast = model, []
for fraction in (None, 0.3):
    if fraction:
        ends = [[0.06, -0.0293, 1.0, -0.0290], [-1.0, -0.0288, 0.06, -0.0293], [-0.0295, -0.1, -0.0295, 1.0]]  # a bend, a corner
        state.walls = make_walls(ends, [[0.0, 0.1]] * 3, model)
    model = cycle.in_static_mode(static, state) if fraction is None else cycle.in_real_time(static, state, fraction)
    state.v[:] = rng.normal(0.0, 1e-5 if fraction is None else 0.3, (12, 2))
    state.spin[:] = rng.normal(0.0, 1e-4 if fraction is None else 5.0, 12)
    fast.append(cycle.advance(model, state, 9.81, 60))
print(balance.unbalanced_ratio(model, state, 9.81), state.counters.tolist())
pairs = np.column_stack([state.shear, state.rolled, state.root_mass, *state.parallel])
np.savez(sys.argv[1], discs=np.column_stack([state.disc, state.load]), pairs=pairs)
walls = [*state.walls.force.ravel(), *state.walls.normal.sum(0), *state.walls.rolled.sum(0)]
np.save(sys.argv[3], [*fast, *walls, energy.kinetic(model, state), energy.stored(model, state)])
"""

TWO_THREADS = """
import sys
import numpy as np
from coupler_protocol.compiled import threads as team
from dem_server.step import neighbours
from dem_server.step import thread_shares as sharing

sharing.RUN = neighbours.RUN = 4  # discs
sharing.FEWEST = 1
from disc_cases import loose_discs
from dem_server.step import cycle
from dem_server.step.walls import make_walls

team.set_size(int(sys.argv[2]))
xy = np.stack(np.meshgrid(np.arange(6.0), np.arange(4.0)), axis=-1).reshape(-1, 2) * 0.0595
model, state = loose_discs(xy, np.full(24, 0.03), True)
state.walls = make_walls([[-1.0, -0.029, 0.1, -0.02925], [1.0, -0.0295, 0.1, -0.02925]], [[0.0, 0.0]] * 2, model)
model = cycle.in_real_time(model, state, 0.3)
state.v[:] = np.random.default_rng(3).normal(0.0, 0.3, (24, 2))
cycle.advance(model, state, 9.81, 40)
print(len(sharing.shares(model)), *state.counters)
np.savez(sys.argv[1], discs=np.column_stack([state.disc, state.load]), pairs=state.shear[:, None])
np.save(sys.argv[3], state.walls.force)
"""


def run(tmp_path, disable, content, script=SCRIPT):
    out, bodies = tmp_path / f"state{disable}.npz", tmp_path / f"bodies{disable}.npy"
    here = Path(__file__).parents[1]
    folders = (here, here.parent / "physics", here.parents[1] / "scripts")
    environment = {"NUMBA_DISABLE_JIT": disable, "PYTHONPATH": os.pathsep.join(map(str, folders))}
    command = [sys.executable, "-c", script, out, content, bodies]
    done = subprocess.run(command, env=os.environ | environment, capture_output=True, text=True, check=True)
    return done.stdout.split(), np.load(out), np.load(bodies)


def same(compiled, plain):
    """Asserts that both are equal to 1e-9 of the largest value in every column; those largest values of the discs."""
    for name in ("discs", "pairs"):
        scale = np.abs(plain[name]).max(axis=0)
        assert (np.abs(compiled[name] - plain[name]) <= 1e-9 * scale).all()
    return np.abs(plain["discs"]).max(axis=0)


def test_compiled_equals_interpreted_with_every_law(tmp_path):
    (ratio, *counts), plain, sums = run(tmp_path, "1", "", ALL_LAWS)
    (compiled_ratio, *compiled_counts), compiled, compiled_sums = run(tmp_path, "0", "", ALL_LAWS)
    assert counts == compiled_counts
    assert any(int(word.strip("[],")) > 0 for word in counts[1:3])  # some bonds broke on the way
    np.testing.assert_allclose([float(compiled_ratio), *compiled_sums], [float(ratio), *sums], rtol=1e-9)
    same(compiled, plain)


def test_interpreted_threads_compute_the_bits_of_one(tmp_path):
    (shares, *counts), alone, wall = run(tmp_path, "1", "1", TWO_THREADS)
    (other_shares, *other_counts), together, other_wall = run(tmp_path, "1", "2", TWO_THREADS)
    assert (shares, other_shares) == ("1", "2")
    assert counts == other_counts
    np.testing.assert_array_equal(wall, other_wall)
    for name in ("discs", "pairs"):
        np.testing.assert_array_equal(alone[name], together[name])


@pytest.mark.parametrize("content", ["0.3", "0.5"], ids=["largest first", "grown"])
def test_compiled_equals_interpreted(tmp_path, content):
    (ratio, *counts), plain, bodies = run(tmp_path, "1", content)
    (compiled_ratio, *compiled_counts), compiled, compiled_bodies = run(tmp_path, "0", content)
    assert counts == compiled_counts
    np.testing.assert_allclose(float(compiled_ratio), float(ratio), rtol=1e-9)
    scale = same(compiled, plain)
    np.testing.assert_allclose(compiled_bodies, bodies, rtol=1e-9, atol=1e-9 * np.abs(bodies[:, :5]).max())
    assert bodies[:, 4].any()
    assert scale[:11].all()  # everything moved, and forces and moments act
