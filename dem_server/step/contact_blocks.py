"""The contacts of a part of the list, block by block.

gather     what a block of pairs needs of its discs, its parameters, and what it remembers, into rows of scratch memory
law        forces of all pairs of the block at once (contact_law.py): a loop without branches, which the
           compiler turns into vector instructions
scatter    forces and moments to the discs, in the order of the list; what the pairs will remember goes back
"""

import numpy as np

from coupler_protocol.compiled.jit import jit
from dem_server.effects.bond import BONDED, BROKEN_SHEAR, BROKEN_TENSION
from dem_server.model import SHEAR_BREAKS, TENSION_BREAKS
from dem_server.step import scratch_rows
from dem_server.step.contact_law import law_of_block


@jit(borrows=True)
def add_parts(
    begin, end, disc, load, first, second, parts, kind, normal, shear, reference_gap, bond_state, rolled, root_mass,
    glued, glue_gap, glue_normal, glue_shear, glue_moment, counters,
    friction, bond, rolling, dashpot, parallel_bond, dt, table, f,
):  # fmt: skip
    """Add the forces of parts begin..end of the list to the loads; table: of `table_of`, f: scratch memory (rows.SIZE,).

    Effects only say that they are there: their parameters come from the table.
    """
    filled = -1
    for part in range(begin, end):
        p0, p1 = parts[part, 0], parts[part, 1]
        while p0 < p1:
            m = min(np.uint64(scratch_rows.LANES), p1 - p0)
            gather(p0, m, first, second, disc, f)
            filled = gather_parameters(p0, m, kind, filled, table, friction, bond, rolling, dashpot, parallel_bond, f)
            gather_history(
                p0, m, shear, reference_gap, bond_state, rolled, root_mass, glued, glue_gap, glue_shear, glue_moment, f
            )  # fmt: skip
            broken = law_of_block(m, dt, f, shear, reference_gap, friction, bond, rolling, dashpot, parallel_bond)
            scatter(p0, m, first, second, load, f)
            keep_history(p0, m, normal, shear, rolled, glue_normal, glue_shear, glue_moment, f)
            if broken > 0:
                keep_bonds(p0, m, bond_state, glued, counters, f)
            p0 += m


@jit(forceinline=True, borrows=True)
def gather(p0, m, first, second, disc, f):
    """What the law needs of both discs."""
    for q in range(m):
        i, j = first[p0 + q], second[p0 + q]
        f[scratch_rows.DX + q], f[scratch_rows.DY + q] = disc[j, 0] - disc[i, 0], disc[j, 1] - disc[i, 1]
        f[scratch_rows.DU + q], f[scratch_rows.DV + q] = disc[j, 2] - disc[i, 2], disc[j, 3] - disc[i, 3]
        f[scratch_rows.RI + q], f[scratch_rows.RJ + q] = disc[i, 5], disc[j, 5]
        f[scratch_rows.WI + q], f[scratch_rows.WJ + q] = disc[i, 4], disc[j, 4]


@jit(forceinline=True, borrows=True)
def gather_parameters(p0, m, kind, filled, table, friction, bond, rolling, dashpot, parallel_bond, f):
    """Parameters of the pairs' kinds; nothing to do where all are of kind `filled`. Returns the kind if it is one, or -1."""
    k, same = np.int64(kind[p0]), True
    for q in range(m):
        same &= kind[p0 + q] == k
    if same and k == filled:
        return filled
    spread(p0, m, same, kind, table, scratch_rows.KN, f)
    spread(p0, m, same, kind, table, scratch_rows.KS, f)
    if friction is not None:
        spread(p0, m, same, kind, table, scratch_rows.FRICTION, f)
    if bond is not None:
        spread(p0, m, same, kind, table, scratch_rows.TENSION, f)
        spread(p0, m, same, kind, table, scratch_rows.STRENGTH, f)
    if rolling is not None:
        spread(p0, m, same, kind, table, scratch_rows.ROLLING, f)
    if dashpot is not None:
        spread(p0, m, same, kind, table, scratch_rows.DASH_N, f)
        spread(p0, m, same, kind, table, scratch_rows.DASH_S, f)
        spread(p0, m, same, kind, table, scratch_rows.PULLS, f)
    if parallel_bond is not None:
        spread(p0, m, same, kind, table, scratch_rows.GLUE_KN, f)
        spread(p0, m, same, kind, table, scratch_rows.GLUE_KS, f)
        spread(p0, m, same, kind, table, scratch_rows.GLUE_TENSION, f)
        spread(p0, m, same, kind, table, scratch_rows.GLUE_COHESION, f)
        spread(p0, m, same, kind, table, scratch_rows.GLUE_RADIUS, f)
    return k if same else np.int64(-1)


@jit(forceinline=True, borrows=True)
def spread(p0, m, same, kind, table, row, f):
    """A parameter of the m pairs from p0 on, or in all lanes where their kind is the same."""
    number = row // np.uint64(scratch_rows.LANES)
    if same:
        value = table[number, kind[p0]]
        for q in range(scratch_rows.LANES):
            f[row + np.uint64(q)] = value
    else:
        for q in range(m):
            f[row + q] = table[number, kind[p0 + q]]


@jit(forceinline=True, borrows=True)
def take(p0, m, array, row, f):
    """Row of what the m pairs from p0 on remember."""
    for q in range(m):
        f[row + q] = array[p0 + q]


@jit(forceinline=True, borrows=True)
def keep(p0, m, array, row, f):
    """The other way round."""
    for q in range(m):
        array[p0 + q] = f[row + q]


@jit(forceinline=True, borrows=True)
def gather_history(
    p0, m, shear, reference_gap, bond_state, rolled, root_mass, glued, glue_gap, glue_shear, glue_moment, f
):  # fmt: skip
    """What the pairs remember."""
    if shear is not None:
        take(p0, m, shear, scratch_rows.SHEAR, f)
    if reference_gap is not None:
        take(p0, m, reference_gap, scratch_rows.GAP, f)
    if bond_state is not None:
        take(p0, m, bond_state, scratch_rows.BONDED, f)
    if rolled is not None:
        take(p0, m, rolled, scratch_rows.ROLLED, f)
    if root_mass is not None:
        take(p0, m, root_mass, scratch_rows.ROOT, f)
    if glued is not None:
        take(p0, m, glued, scratch_rows.GLUED, f)
        take(p0, m, glue_gap, scratch_rows.GLUE_GAP, f)
        take(p0, m, glue_shear, scratch_rows.GLUE_S, f)
        take(p0, m, glue_moment, scratch_rows.GLUE_M, f)


@jit(forceinline=True, borrows=True)
def scatter(p0, m, first, second, load, f):
    """Forces and moments to both discs of each pair."""
    for q in range(m):
        i, j = first[p0 + q], second[p0 + q]
        px, py = f[scratch_rows.PX + q], f[scratch_rows.PY + q]
        load[i, 0] -= px
        load[i, 1] -= py
        load[i, 2] -= f[scratch_rows.MI + q]
        load[j, 0] += px
        load[j, 1] += py
        load[j, 2] -= f[scratch_rows.MJ + q]


@jit(forceinline=True, borrows=True)
def keep_history(p0, m, normal, shear, rolled, glue_normal, glue_shear, glue_moment, f):
    """What the pairs will remember; bonds only change where one breaks."""
    keep(p0, m, normal, scratch_rows.FN, f)
    if shear is not None:
        keep(p0, m, shear, scratch_rows.SHEAR, f)
    if rolled is not None:
        keep(p0, m, rolled, scratch_rows.ROLLED, f)
    if glue_normal is not None:
        keep(p0, m, glue_normal, scratch_rows.GLUE_N, f)
        keep(p0, m, glue_shear, scratch_rows.GLUE_S, f)
        keep(p0, m, glue_moment, scratch_rows.GLUE_M, f)


@jit(borrows=True)
def keep_bonds(p0, m, bond_state, glued, counters, f):
    """States of bonds after some of the m from p0 on broke, and the counts of broken ones."""
    for q in range(m):
        if bond_state is not None:
            now = np.int8(f[scratch_rows.BONDED + q])
            count(bond_state[p0 + q], now, counters)
            bond_state[p0 + q] = now
        if glued is not None:
            now = np.int8(f[scratch_rows.GLUED + q])
            count(glued[p0 + q], now, counters)
            glued[p0 + q] = now


@jit(borrows=True)
def count(before, now, counters):
    """Count a bond that broke."""
    if before == BONDED and now == BROKEN_TENSION:
        counters[TENSION_BREAKS] += 1
    if before == BONDED and now == BROKEN_SHEAR:
        counters[SHEAR_BREAKS] += 1


@jit
def table_of(spring, friction, bond, rolling, dashpot, parallel_bond):
    """Parameters of all effects in one array (rows, kinds), each in the row that it has in the scratch memory."""
    table = np.zeros((scratch_rows.COUNT, len(spring.normal)))
    put(spring.normal, scratch_rows.KN, table)
    put(spring.shear, scratch_rows.KS, table)
    if friction is not None:
        put(friction.coefficient, scratch_rows.FRICTION, table)
    if bond is not None:
        put(bond.tension, scratch_rows.TENSION, table)
        put(bond.shear, scratch_rows.STRENGTH, table)
    if rolling is not None:
        put(rolling.coefficient, scratch_rows.ROLLING, table)
    if dashpot is not None:
        put(dashpot.normal, scratch_rows.DASH_N, table)
        put(dashpot.shear, scratch_rows.DASH_S, table)
        put(dashpot.tension, scratch_rows.PULLS, table)
    if parallel_bond is not None:
        put(parallel_bond.normal, scratch_rows.GLUE_KN, table)
        put(parallel_bond.shear, scratch_rows.GLUE_KS, table)
        put(parallel_bond.tension, scratch_rows.GLUE_TENSION, table)
        put(parallel_bond.cohesion, scratch_rows.GLUE_COHESION, table)
        put(parallel_bond.radius, scratch_rows.GLUE_RADIUS, table)
    return table


@jit
def put(values, row, table):
    """One row of `table_of`."""
    for k in range(len(values)):
        table[row // np.uint64(scratch_rows.LANES), k] = values[k]
