"""Contact forces: one pass over the list of pairs.

The list is summed part by part (neighbours.py): the ring's pairs, runs of even number, of odd number, and pairs of distant
discs. Runs of one colour touch different discs, so threads may share them, and every disc gets its forces in the same order
whatever the number of threads.
"""

import numpy as np

from coupler_protocol.compiled.jit import jit
from dem_server.effects.parallel_bond import ParallelBonds
from dem_server.step import neighbours, scratch_rows, walls
from dem_server.step.contact_blocks import add_parts, table_of
from dem_server.step.thread_crew import meet, part_of, work_together
from dem_server.step.thread_shares import shares
from dem_server.step.walls import wall_pass

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
    listed, laws, split = arguments(model, state), laws_of(model), shares(model)
    if len(split) > 1:
        work_together(lambda _, __, counts, crew: force_pass(*listed, counts, *laws, state.dt, crew), split, state.counters)
    else:
        force_pass(*listed, state.counters, *laws, state.dt, None)
    if state.walls is not None:
        wall_pass(state.disc, state.load, state.dt, *walls.arguments(model, state))


def arguments(model, state):
    """What `force_pass` takes before counters and laws: discs, list, and what its pairs remember."""
    return (
        state.disc, state.load, state.first, state.second, state.parts, state.kind,
        state.normal, state.shear, state.reference_gap, state.bond_state, state.rolled, state.root_mass,
        *(state.parallel or NO_BONDS),
    )  # fmt: skip


def laws_of(model):
    """What `force_pass` takes after the counters."""
    law = model.law
    return law.spring, law.friction, law.bond, law.rolling, law.dashpot, law.parallel_bond


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
    spring, friction, bond, rolling, dashpot, parallel_bond, dt, crew,
):  # fmt: skip
    """Loads of all discs from all listed pairs, by one thread (`crew` None) or by all of the crew that call it together."""
    table, f = table_of(spring, friction, bond, rolling, dashpot, parallel_bond), np.empty(scratch_rows.SIZE)
    if crew is None:
        load[:] = 0.0
        add_parts(
            0, len(parts), disc, load, first, second, parts, kind, normal, shear, reference_gap, bond_state, rolled,
            root_mass, glued, glue_gap, glue_normal, glue_shear, glue_moment, counters, friction, bond, rolling, dashpot,
            parallel_bond, dt, table, f,
        )  # fmt: skip
    else:
        begin, end = part_of(crew, 0, len(load))
        load[begin:end] = 0.0
        meet(crew)
        even, last = 1 + (len(parts) - 1) // 2, len(parts) - 1
        for begin, end, shared in ((0, 1, False), (1, even, True), (even, last, True), (last, last + 1, False)):
            if shared:
                begin, end = part_of(crew, begin, end)
            if shared or crew.rank == 0:
                add_parts(
                    begin, end, disc, load, first, second, parts, kind, normal, shear, reference_gap, bond_state, rolled,
                    root_mass, glued, glue_gap, glue_normal, glue_shear, glue_moment, counters, friction, bond, rolling,
                    dashpot, parallel_bond, dt, table, f,
                )  # fmt: skip
            meet(crew)
