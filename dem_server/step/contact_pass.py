"""Contact forces: one pass over the list of pairs.

The list is summed part by part (neighbours.py): the ring's pairs, runs of even number, of odd number, and pairs of distant
discs. Runs of the same parity touch different discs, so threads may share them, and every disc gets its forces in the same order
for any number of threads.
"""

import numpy as np

from coupler_protocol.compiled.jit import jit
from coupler_protocol.compiled.thread_crew import meet, part_of, work_together
from dem_server.effects.histories import PairHistory, history_of
from dem_server.effects.parameter_table import Parameters
from dem_server.model import Listed, X, Y
from dem_server.step import neighbours, scratch_rows, walls
from dem_server.step.contact_blocks import add_parts
from dem_server.step.thread_shares import shares
from dem_server.step.walls import wall_pass_of


def contact_forces(model, state):
    """Computes forces and moments on all discs, also of the ring, from the motion of this step; bonds may break.

    Rebuilds the neighbour list first if a disc has moved too far since the last time. Shear forces grow with
    every call by the slip of the present velocities: call it once a step.
    """
    make_current(model, state)
    add_forces(model, state)


def make_current(model, state):
    """Rebuilds the neighbour list if a disc has moved too far since the last time."""
    while not farthest(state.disc, state.listed_at) <= 0.5 * neighbours.skin(model):
        neighbours.rebuild(model, state)


def add_forces(model, state):
    """Computes forces and moments on all discs from the present list."""
    # plain tuples at the border: for a named one numba looks up its class at every call
    tuples = tuple(state.listed), tuple(history_of(state)), tuple(model.parameters)
    split, known = shares(model), (state.disc, state.load, *tuples, state.dt)
    if len(split) > 1:
        work_together(lambda _, __, counts, crew: force_pass(*known, counts, crew), split, state.counters)
    else:
        force_pass(*known, state.counters, None)
    if state.walls is not None:
        wall_pass_of(state.disc, state.load, state.dt, *walls.arguments(model, state))


@jit
def farthest(disc, listed_at):
    """Largest distance [m] of a disc from its position when the list was made; infinite for a position that is NaN."""
    largest = 0.0
    for i in range(len(disc)):
        dx, dy = disc[i, X] - listed_at[i, 0], disc[i, Y] - listed_at[i, 1]
        moved = dx * dx + dy * dy
        largest = max(largest, moved if moved == moved else np.inf)
    return largest**0.5


@jit(borrows=True)
def number_of_parts(listed):
    """Number of parts of the list."""
    return len(listed.parts)


@jit
def force_pass(disc, load, listed, history, parameters, dt, counters, crew):
    """Computes loads of all discs from all listed pairs, by one thread (`crew` None) or by all threads of the crew together.

    listed, history, parameters: a Listed, a PairHistory and the Parameters as plain tuples.
    """
    named = Listed(*listed), PairHistory(*history), Parameters(*parameters)
    add_list(disc, load, *named, dt, counters, crew, np.empty(scratch_rows.SIZE))


@jit(borrows=True)
def add_list(disc, load, listed, history, parameters, dt, counters, crew, f):
    """`force_pass` with scratch memory f (scratch_rows.SIZE,)."""
    add_ring(disc, load, listed, history, parameters, dt, counters, crew, f)
    add_inside(disc, load, listed, history, parameters, dt, counters, crew, f)


@jit(borrows=True)
def add_ring(disc, load, listed, history, parameters, dt, counters, crew, f):
    """First half of `add_list`: the pairs of the ring, by one thread, after which its loads are complete."""
    if crew is None:
        load[:] = 0.0
        add_parts(np.int64(0), np.int64(1), disc, load, listed, history, counters, parameters, dt, f)
    else:
        begin, end = part_of(crew, 0, len(load))
        load[begin:end] = 0.0
        meet(crew)
        if crew.rank == 0:
            add_parts(np.int64(0), np.int64(1), disc, load, listed, history, counters, parameters, dt, f)
        meet(crew)


@jit(borrows=True)
def add_inside(disc, load, listed, history, parameters, dt, counters, crew, f):
    """Second half: all other pairs."""
    parts = number_of_parts(listed)
    if crew is None:
        add_parts(np.int64(1), parts, disc, load, listed, history, counters, parameters, dt, f)
    else:
        even, last = 1 + (parts - 1) // 2, parts - 1
        for begin, end, shared in ((1, even, True), (even, last, True), (last, last + 1, False)):
            if shared:
                begin, end = part_of(crew, begin, end)
            if shared or crew.rank == 0:
                add_parts(begin, end, disc, load, listed, history, counters, parameters, dt, f)
            meet(crew)
