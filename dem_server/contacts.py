"""Contact forces: one pass over the list of pairs, in blocks.

    gather     what a block of pairs needs of its discs, and what it remembers, into rows of scratch memory
    law        forces of all pairs of the block at once (contact_law.py): a loop without branches, which the
               compiler turns into vector instructions
    scatter    forces and moments to the discs, in the order of the list

The list is summed part by part (neighbours.py). Parts of one colour touch different discs, so two threads may share
them, and every disc gets its forces in the same order whatever the number of threads.
"""

import numpy as np

from coupler_protocol import team
from coupler_protocol.jit import jit
from dem_server import neighbours, rows, walls
from dem_server.contact_law import law_of_block
from dem_server.effects.bond import BONDED, BROKEN_SHEAR, BROKEN_TENSION
from dem_server.model import SHEAR_BREAKS, TENSION_BREAKS
from dem_server.sharing import shares
from dem_server.walls import wall_pass


def contact_forces(model, state):
    """Forces and moments on all discs, ring included, from the motion of this step; bonds may break.

    Rebuilds the neighbour list first if a disc has moved too far since the last time. Shear forces grow with
    every call by the slip of the present velocities: call it once a step.
    """
    while not farthest(state.disc, state.listed_at) <= 0.5 * neighbours.skin(model):
        neighbours.rebuild(model, state)
    if len(shares(model)) > 1:
        pass_together(model, state)
    else:
        force_pass(*arguments(model, state))
    if state.walls is not None:
        wall_pass(state.disc, state.load, state.dt, *walls.arguments(model, state))


def pass_together(model, state):
    """`force_pass` by several threads: parts of one colour at the same time, each thread with a count of its own."""
    disc, load, *between, counters, spring, friction, bond, rolling, dashpot, parallel_bond, dt = arguments(model, state)
    law, runs = (spring, friction, bond, rolling, dashpot, parallel_bond, dt), len(state.parts) - 2
    even = 1 + (runs + 1) // 2
    load[:] = 0.0
    counts = [np.zeros_like(counters) for _ in shares(model)]

    def add(begin, end, count):
        add_parts(begin, end, disc, load, *between, count, *law)

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
        state.normal, state.shear, state.reference_gap, state.bond_state, state.rolled, state.root_mass, state.parallel,
        state.counters, law.spring, law.friction, law.bond, law.rolling, law.dashpot, law.parallel_bond, state.dt,
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
    disc, load, first, second, parts, kind,
    normal, shear, reference_gap, bond_state, rolled, root_mass, parallel,
    counters, spring, friction, bond, rolling, dashpot, parallel_bond, dt,
):  # fmt: skip
    """Loads of all discs from all listed pairs."""
    load[:] = 0.0
    add_parts(
        0, len(parts), disc, load, first, second, parts, kind, normal, shear, reference_gap, bond_state, rolled, root_mass,
        parallel, counters, spring, friction, bond, rolling, dashpot, parallel_bond, dt,
    )  # fmt: skip


@jit
def add_parts(
    begin, end, disc, load, first, second, parts, kind,
    normal, shear, reference_gap, bond_state, rolled, root_mass, parallel,
    counters, spring, friction, bond, rolling, dashpot, parallel_bond, dt,
):  # fmt: skip
    """Add the forces of parts begin..end of the list to the loads."""
    f = np.empty(rows.SIZE)
    filled = -1
    for part in range(begin, end):
        p0, p1 = parts[part, 0], parts[part, 1]
        while p0 < p1:
            m = min(np.uint64(rows.LANES), p1 - p0)
            gather(p0, m, first, second, disc, f)
            filled = gather_parameters(
                p0, m, kind, filled, shear, spring, friction, bond, rolling, dashpot, parallel_bond, f
            )
            gather_history(p0, m, shear, reference_gap, bond_state, rolled, root_mass, parallel, f)
            broken = law_of_block(m, dt, f, shear, reference_gap, friction, bond, rolling, dashpot, parallel_bond)
            scatter(p0, m, first, second, load, f)
            keep_history(p0, m, normal, shear, rolled, parallel, f)
            if broken > 0:
                keep_bonds(p0, m, bond_state, parallel, counters, f)
            p0 += m


@jit(forceinline=True)
def gather(p0, m, first, second, disc, f):
    """What the law needs of both discs."""
    for q in range(m):
        i, j = first[p0 + q], second[p0 + q]
        f[rows.DX + q], f[rows.DY + q] = disc[j, 0] - disc[i, 0], disc[j, 1] - disc[i, 1]
        f[rows.DU + q], f[rows.DV + q] = disc[j, 2] - disc[i, 2], disc[j, 3] - disc[i, 3]
        f[rows.RI + q], f[rows.RJ + q] = disc[i, 5], disc[j, 5]
        f[rows.WI + q], f[rows.WJ + q] = disc[i, 4], disc[j, 4]


@jit(forceinline=True)
def gather_parameters(p0, m, kind, filled, shear, spring, friction, bond, rolling, dashpot, parallel_bond, f):
    """Parameters of the pairs' kinds; nothing to do where all are of kind `filled`. Returns the kind if it is one, or -1."""
    k, same = kind[p0], True
    for q in range(m):
        same &= kind[p0 + q] == k
    if same and k == filled:
        return filled
    spread(p0, m, same, kind, spring.normal, rows.KN, f)
    if shear is not None:
        spread(p0, m, same, kind, spring.shear, rows.KS, f)
    if friction is not None:
        spread(p0, m, same, kind, friction.coefficient, rows.FRICTION, f)
    if bond is not None:
        spread(p0, m, same, kind, bond.tension, rows.TENSION, f)
        spread(p0, m, same, kind, bond.shear, rows.STRENGTH, f)
    if rolling is not None:
        spread(p0, m, same, kind, spring.shear, rows.KS, f)
        spread(p0, m, same, kind, rolling.coefficient, rows.ROLLING, f)
    if dashpot is not None:
        spread(p0, m, same, kind, dashpot.normal, rows.DASH_N, f)
        spread(p0, m, same, kind, dashpot.shear, rows.DASH_S, f)
        spread(p0, m, same, kind, dashpot.tension, rows.PULLS, f)
    if parallel_bond is not None:
        spread(p0, m, same, kind, parallel_bond.normal, rows.GLUE_KN, f)
        spread(p0, m, same, kind, parallel_bond.shear, rows.GLUE_KS, f)
        spread(p0, m, same, kind, parallel_bond.tension, rows.GLUE_TENSION, f)
        spread(p0, m, same, kind, parallel_bond.cohesion, rows.GLUE_COHESION, f)
        spread(p0, m, same, kind, parallel_bond.radius, rows.GLUE_RADIUS, f)
    return np.int64(k) if same else np.int64(-1)


@jit(forceinline=True)
def spread(p0, m, same, kind, table, row, f):
    """A parameter of the m pairs from p0 on, or in all lanes where their kind is the same."""
    if same:
        value = 1.0 * table[kind[p0]]
        for q in range(rows.LANES):
            f[row + np.uint64(q)] = value
    else:
        for q in range(m):
            f[row + q] = table[kind[p0 + q]]


@jit(forceinline=True)
def take(p0, m, array, row, f):
    """Row of what the m pairs from p0 on remember."""
    for q in range(m):
        f[row + q] = array[p0 + q]


@jit(forceinline=True)
def keep(p0, m, array, row, f):
    """The other way round."""
    for q in range(m):
        array[p0 + q] = f[row + q]


@jit(forceinline=True)
def gather_history(p0, m, shear, reference_gap, bond_state, rolled, root_mass, parallel, f):
    """What the pairs remember."""
    if shear is not None:
        take(p0, m, shear, rows.SHEAR, f)
    if reference_gap is not None:
        take(p0, m, reference_gap, rows.GAP, f)
    if bond_state is not None:
        take(p0, m, bond_state, rows.BONDED, f)
    if rolled is not None:
        take(p0, m, rolled, rows.ROLLED, f)
    if root_mass is not None:
        take(p0, m, root_mass, rows.ROOT, f)
    if parallel is not None:
        take(p0, m, parallel.state, rows.GLUED, f)
        take(p0, m, parallel.gap, rows.GLUE_GAP, f)
        take(p0, m, parallel.shear, rows.GLUE_S, f)
        take(p0, m, parallel.moment, rows.GLUE_M, f)


@jit(forceinline=True)
def scatter(p0, m, first, second, load, f):
    """Forces and moments to both discs of each pair."""
    for q in range(m):
        i, j = first[p0 + q], second[p0 + q]
        px, py = f[rows.PX + q], f[rows.PY + q]
        load[i, 0] -= px
        load[i, 1] -= py
        load[i, 2] -= f[rows.MI + q]
        load[j, 0] += px
        load[j, 1] += py
        load[j, 2] -= f[rows.MJ + q]


@jit(forceinline=True)
def keep_history(p0, m, normal, shear, rolled, parallel, f):
    """What the pairs will remember; bonds only change where one breaks."""
    keep(p0, m, normal, rows.FN, f)
    if shear is not None:
        keep(p0, m, shear, rows.SHEAR, f)
    if rolled is not None:
        keep(p0, m, rolled, rows.ROLLED, f)
    if parallel is not None:
        keep(p0, m, parallel.normal, rows.GLUE_N, f)
        keep(p0, m, parallel.shear, rows.GLUE_S, f)
        keep(p0, m, parallel.moment, rows.GLUE_M, f)


@jit
def keep_bonds(p0, m, bond_state, parallel, counters, f):
    """States of bonds after some of the m from p0 on broke, and the counts of broken ones."""
    for q in range(m):
        if bond_state is not None:
            now = np.int8(f[rows.BONDED + q])
            count(bond_state[p0 + q], now, counters)
            bond_state[p0 + q] = now
        if parallel is not None:
            now = np.int8(f[rows.GLUED + q])
            count(parallel.state[p0 + q], now, counters)
            parallel.state[p0 + q] = now


@jit
def count(before, now, counters):
    """Count a bond that broke."""
    if before == BONDED and now == BROKEN_TENSION:
        counters[TENSION_BREAKS] += 1
    if before == BONDED and now == BROKEN_SHEAR:
        counters[SHEAR_BREAKS] += 1
