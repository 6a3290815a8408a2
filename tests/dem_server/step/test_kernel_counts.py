"""No reference counting inside any loop of the discs' kernels: see tests/kernel_counts.py."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[2]

SCRIPT = """
import json
import numpy as np
from kernel_counts import counts_in_loops, kernels
from disc_cases import loose_discs
from window_case import stone_grain
from dem_server.observe import unbalanced_ratio as balance
from dem_server.step import contact_pass as contacts
from dem_server.step import cycle
from dem_server.observe import energy
from dem_server.step import guards
from dem_server.step import neighbours
from dem_server.stones import bodies as stones
from dem_server.step.bonds_made import add_parallel_bonds
from dem_server.effects.dashpot import Dashpot
from dem_server.effects.parallel_bond import ParallelBond
from dem_server.effects.rolling import Rolling
from dem_server.step.servo import make_servo
from dem_server.step.walls import make_walls

cement = ParallelBond(normal_stiffness=1e9, shear_stiffness=5e8, tension=1.2e5, shear=2e5, radius=0.8)
tables = {"rolling": Rolling(coefficient=0.2), "dashpot": Dashpot(normal=0.2), "parallel_bond": cement}
xy = np.stack(np.meshgrid(np.arange(4.0), np.arange(3.0)), axis=-1).reshape(-1, 2) * 0.0595
stone = stone_grain()
for name in tables:
    setattr(stone, name, tables[name])
for changes in ({}, tables):
    model, state = loose_discs(xy, np.full(12, 0.03), True, stone=stone if changes else stone_grain(), **changes)
    if changes:
        square = np.array([[-0.01, -0.01], [0.07, -0.01], [0.07, 0.07], [-0.01, 0.07]])
        stones.mark(model, state, [square], 2700.0)
        model = stones.make(model, state, [square], "clump")
        add_parallel_bonds(model, state)
        ends = np.array([[-1.0, -0.0295, 1.0, -0.0295]])
        state.walls = make_walls(ends, [[0.0, 0.0]], model, make_servo(ends, state.x))
        state.walls.servo.pressure[:] = state.walls.servo.fastest[:] = 1e-3
    neighbours.rebuild(model, state)  # with what the lines above made
    cycle.advance(model, state, 9.81, 5)
    if changes:
        middle = (model.ring + model.count) // 2
        contacts.shares = cycle.shares = lambda model: [(model.ring, middle), (middle, model.count)]
        cycle.advance(model, state, 9.81, 5)
    guards.quickest(model, state)
    balance.unbalanced_ratio(model, state, 9.81), energy.kinetic(model, state), energy.stored(model, state)
print(json.dumps({name: counts_in_loops(kernel) for name, kernel in kernels("dem_server").items()}))
"""

PROOF = """
import json
import numba
import numpy as np
from kernel_counts import counts_in_loops


@numba.njit
def keeps(arrays, n):
    kept = arrays[0]
    for i in range(n):
        kept = arrays[i % 2]
        kept[0] += 1.0
    return kept

@numba.njit
def clean(a):
    for i in range(len(a)):
        a[i] += 1.0
    return a

keeps((np.zeros(3), np.zeros(3)), 4)
clean(np.zeros(3))
print(json.dumps([counts_in_loops(keeps), counts_in_loops(clean)]))
"""


def run(script, tmp_path):
    folders = os.pathsep.join(str(f) for f in (TESTS, TESTS / "physics", TESTS / "dem_server", TESTS.parent / "scripts"))
    environment = os.environ | {"PYTHONPATH": folders, "NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def test_the_count_sees_what_it_looks_for(tmp_path):
    seen, clean = run(PROOF, tmp_path)
    assert seen > 0
    assert clean == 0


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    return run(SCRIPT, tmp_path_factory.mktemp("cache"))


def test_no_loop_of_any_kernel_counts_references(found):
    assert {name: count for name, count in found.items() if count} == {}


def test_the_kernels_were_seen(found):
    names = {name.rpartition(".")[2] for name in found}
    others = {"near_pairs", "sorted_pairs", "places", "quickest_kernel"}
    assert others | {"force_pass", "move", "cycle", "add_up", "ratio", "wall_pass", "move_walls"} <= names
