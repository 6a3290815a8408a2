"""Compiles the discs' kernels where their code can be inspected, and prints as JSON what tests ask of that code.

    python -m tests.dem_server.step.inspected_kernels

counts: {kernel: reference counts inside its loops}; vector: for each of four laws, whether roots and divisions of the contact law
are taken of many contacts at once. Code that comes from the disk cache cannot be inspected, so nothing is read from it here; what
is compiled is written to it as always, for the tests that follow.
"""

import json
import re
import sys

import numpy as np
from numba.core.caching import FunctionCache
from numba.core.dispatcher import Dispatcher

FunctionCache.load_overload = lambda cache, signature, context: None  # before the first kernel is called

from verification.discrete.discs import loose_discs  # noqa: E402

from dem_server.effects.dashpot import Dashpot  # noqa: E402
from dem_server.effects.parallel_bond import ParallelBond  # noqa: E402
from dem_server.effects.rolling import Rolling  # noqa: E402
from dem_server.observe import energy, unbalanced_ratio  # noqa: E402
from dem_server.step import contact_blocks, contact_pass, cycle, guards, neighbours  # noqa: E402
from dem_server.step.bonds_made import add_parallel_bonds  # noqa: E402
from dem_server.step.servo import make_servo  # noqa: E402
from dem_server.step.walls import make_walls  # noqa: E402
from dem_server.stones import bodies  # noqa: E402
from tests.dem_server.step.reference_counts import counts_in_loops  # noqa: E402
from tests.dem_server.window_case import stone_grain  # noqa: E402

CEMENT = ParallelBond(normal_stiffness=1e9, shear_stiffness=5e8, tension=1.2e5, shear=2e5, radius=0.8)
TABLES = {"rolling": Rolling(coefficient=0.2), "dashpot": Dashpot(normal=0.2), "parallel_bond": CEMENT}
LAWS = ({"bond": None, "friction": None}, {"bond": None}, {}, TABLES)


def vector_code():
    """For each signature of the contact law, (roots, divisions) taken of many contacts at once (x86-64)."""
    xy = np.outer(np.arange(4.0), [0.0595, 0.0])
    for changes in LAWS:
        contact_pass.contact_forces(*loose_discs(xy, np.full(4, 0.03), **changes))
    code = contact_blocks.add_parts.inspect_asm().values()
    return [tuple(bool(re.search(rf"\bv?{word}\b", text)) for word in ("sqrtpd", "divpd")) for text in code]


def use(tables):
    """A step with its guards and sums, of bonded discs or of a stone and soil with `tables` on a wall with a servo."""
    xy = np.stack(np.meshgrid(np.arange(4.0), np.arange(3.0)), axis=-1).reshape(-1, 2) * 0.0595
    stone = stone_grain()
    for name in tables:
        setattr(stone, name, tables[name])
    model, state = loose_discs(xy, np.full(12, 0.03), True, stone=stone, **tables)
    if tables:
        square = np.array([[-0.01, -0.01], [0.07, -0.01], [0.07, 0.07], [-0.01, 0.07]])
        bodies.assign_discs(model, state, [square], 2700.0)
        model = bodies.form_stones(model, state, [square], "clump")
        add_parallel_bonds(model, state)
        ends = np.array([[-1.0, -0.0295, 1.0, -0.0295]])
        state.walls = make_walls(ends, [[0.0, 0.0]], model, make_servo(ends, state.x))
        state.walls.servo.pressure[:] = state.walls.servo.fastest[:] = 1e-3
    neighbours.rebuild(model, state)  # with what the lines above made
    cycle.advance(model, state, 9.81, 5)
    if tables:
        middle = (model.ring + model.count) // 2
        contact_pass.shares = cycle.shares = lambda model: [(model.ring, middle), (middle, model.count)]
        cycle.advance(model, state, 9.81, 5)
    guards.quickest(model, state)
    unbalanced_ratio.unbalanced_ratio(model, state, 9.81), energy.kinetic(model, state), energy.stored(model, state)


def kernels(package):
    """All compiled functions of the package that were used in this process: {name: dispatcher}."""
    found = {}
    for name, module in list(sys.modules.items()):
        if name.partition(".")[0] == package:
            for value in vars(module).values():
                if isinstance(value, Dispatcher) and value.signatures:
                    found[f"{value.py_func.__module__}.{value.py_func.__name__}"] = value
    return found


if __name__ == "__main__":
    vector = vector_code()
    for tables in ({}, TABLES):
        use(tables)
    counts = {name: counts_in_loops(kernel) for name, kernel in kernels("dem_server").items()}
    print(json.dumps({"counts": counts, "vector": vector}))
