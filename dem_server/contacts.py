"""Contact forces: one pass over the list of pairs.

The list is summed part by part (neighbours.py). Parts of one colour touch different discs, so two threads may share
them, and every disc gets its forces in the same order whatever the number of threads.
"""

import numpy as np

from coupler_protocol import team
from coupler_protocol.jit import jit
from dem_server import neighbours, rows, walls
from dem_server.contact_blocks import add_parts, table_of
from dem_server.effects.parallel_bond import ParallelBonds
from dem_server.sharing import shares
from dem_server.walls import wall_pass

NO_BONDS = ParallelBonds(None, None, None, None, None)


def contact_forces(model, state):
    """Forces and moments on all discs, ring included, from the motion of this step; bonds may break.

    Rebuilds the neighbour list first if a disc has moved too far since the last time. Shear forces grow with
    every call by the slip of the present velocities: call it once a step.
    """
    make_current(model, state)
    add_forces(model, state)


def make_current(model, state):
    """Rebuild the neighbour list if a disc has moved too far since the last time."""
    while not farthest(state.disc, state.listed_at) <= 0.5 * neighbours.skin(model):
        neighbours.rebuild(model, state)


def add_forces(model, state):
    """Forces and moments on all discs from the list as it is."""
    if len(shares(model)) > 1:
        pass_together(model, state)
    else:
        force_pass(*arguments(model, state))
    if state.walls is not None:
        wall_pass(state.disc, state.load, state.dt, *walls.arguments(model, state))


def pass_together(model, state):
    """`force_pass` by several threads: parts of one colour at the same time, each thread with a count of its own."""
    disc, load, *between, counters, spring, friction, bond, rolling, dashpot, parallel_bond, dt = arguments(model, state)
    effects, runs = (friction, bond, rolling, dashpot, parallel_bond), len(state.parts) - 2
    table = table_of(spring, *effects)
    even = 1 + (runs + 1) // 2
    load[:] = 0.0
    counts = [np.zeros_like(counters) for _ in shares(model)]

    def add(begin, end, count):
        add_parts(begin, end, disc, load, *between, count, *effects, dt, table, np.empty(rows.SIZE))

    add(0, 1, counts[0])
    for begin, end in ((1, even), (even, 1 + runs)):
        cuts = [begin + (end - begin) * k // len(counts) for k in range(len(counts) + 1)]
        team.each(add, list(zip(cuts[:-1], cuts[1:], counts, strict=True)))
    add(1 + runs, 2 + runs, counts[0])
    counters += sum(counts)


def arguments(model, state):
    """What `force_pass` takes."""
    law = model.law
    return (
        state.disc, state.load, state.first, state.second, state.parts, state.kind,
        state.normal, state.shear, state.reference_gap, state.bond_state, state.rolled, state.root_mass,
        *(state.parallel or NO_BONDS), state.counters,
        law.spring, law.friction, law.bond, law.rolling, law.dashpot, law.parallel_bond, state.dt,
    )  # fmt: skip


@jit
def farthest(disc, listed_at):
    """How far any disc is from where it was when the list was made [m]; infinite if one is nowhere."""
    largest = 0.0
    for i in range(len(disc)):
        dx, dy = disc[i, 0] - listed_at[i, 0], disc[i, 1] - listed_at[i, 1]
        moved = dx * dx + dy * dy
        largest = max(largest, moved if moved == moved else np.inf)
    return largest**0.5


@jit
def force_pass(
    disc, load, first, second, parts, kind, normal, shear, reference_gap, bond_state, rolled, root_mass,
    glued, glue_gap, glue_normal, glue_shear, glue_moment, counters,
    spring, friction, bond, rolling, dashpot, parallel_bond, dt,
):  # fmt: skip
    """Loads of all discs from all listed pairs."""
    load[:] = 0.0
    add_parts(
        0, len(parts), disc, load, first, second, parts, kind, normal, shear, reference_gap, bond_state, rolled, root_mass,
        glued, glue_gap, glue_normal, glue_shear, glue_moment, counters, friction, bond, rolling, dashpot, parallel_bond, dt,
        table_of(spring, friction, bond, rolling, dashpot, parallel_bond), np.empty(rows.SIZE),
    )  # fmt: skip
