"""The contacts of a part of the list, in blocks.

gather     values of the discs, parameters and histories of a block of pairs, into rows of scratch memory
law        forces of all pairs of the block at once (contact_law.py): a loop without branches, which the
           compiler turns into vector instructions
scatter    forces and moments to the discs, in the order of the list; histories of the pairs back to their arrays
"""

import numpy as np

from coupler_protocol.compiled.jit import jit
from dem_server.effects.bond import BONDED, BROKEN_SHEAR, BROKEN_TENSION
from dem_server.model import FX, FY, MOMENT, RADIUS, SHEAR_BREAKS, SPIN, TENSION_BREAKS, VX, VY, X, Y
from dem_server.step import scratch_rows
from dem_server.step.contact_law import law_of_block


@jit(borrows=True)
def add_parts(begin, end, disc, load, listed, history, counters, parameters, dt, f):
    """Adds the forces of parts begin..end of the list to the loads; f: scratch memory (scratch_rows.SIZE,).

    An absent effect must be a separate argument of the function that tests it, so tuples are opened at the calls.
    """
    filled = np.int64(-1)  # for a literal number numba would compile `gather_parameters` once more
    for part in range(begin, end):
        p0, p1 = listed.parts[part, 0], listed.parts[part, 1]
        while p0 < p1:
            m = min(scratch_rows.LANES, p1 - p0)
            gather(p0, m, listed.first, listed.second, disc, f)
            filled = gather_parameters(p0, m, listed.kind, filled, parameters.values, parameters.present, f)
            gather_history(p0, m, history, f)
            broken = law_of_block(
                m, dt, f, history.shear, history.reference_gap, parameters.friction, parameters.bond, parameters.rolling,
                parameters.dashpot, parameters.parallel_bond,
            )  # fmt: skip
            scatter(p0, m, listed.first, listed.second, load, f)
            store_history(p0, m, history, f)
            if broken > 0:
                store_bonds(p0, m, history.bond_state, history.parallel, counters, f)
            p0 += m


@jit(forceinline=True, borrows=True)
def gather(p0, m, first, second, disc, f):
    """Copies values of both discs of each pair into scratch rows."""
    for q in range(m):
        i, j = first[p0 + q], second[p0 + q]
        f[scratch_rows.DX + q], f[scratch_rows.DY + q] = disc[j, X] - disc[i, X], disc[j, Y] - disc[i, Y]
        f[scratch_rows.DU + q], f[scratch_rows.DV + q] = disc[j, VX] - disc[i, VX], disc[j, VY] - disc[i, VY]
        f[scratch_rows.RI + q], f[scratch_rows.RJ + q] = disc[i, RADIUS], disc[j, RADIUS]
        f[scratch_rows.WI + q], f[scratch_rows.WJ + q] = disc[i, SPIN], disc[j, SPIN]


@jit(forceinline=True, borrows=True)
def gather_parameters(p0, m, kind, filled, values, present, f):
    """Copies parameters of the pairs' kinds, unless all are of kind `filled`; returns the kind if all have one, else -1."""
    k, same = np.int64(kind[p0]), np.bool_(True)
    for q in range(m):
        same &= kind[p0 + q] == k
    if same and k == filled:
        return filled
    for r in range(len(present)):
        spread(p0, m, same, kind, values, present[r], f)
    return k if same else np.int64(-1)


@jit(forceinline=True, borrows=True)
def spread(p0, m, same, kind, values, number, f):
    """Copies a row of parameters of the m pairs from p0 on, or one value into all lanes if all have the same kind."""
    row = number * scratch_rows.LANES
    if same:
        value = values[number, kind[p0]]
        for q in range(scratch_rows.LANES):
            f[row + q] = value
    else:
        for q in range(m):
            f[row + q] = values[number, kind[p0 + q]]


@jit(forceinline=True, borrows=True)
def fill_row(p0, m, array, row, f):
    """Copies a history of the pairs p0 .. p0 + m into its scratch row; does nothing for None."""
    if array is not None:
        for q in range(m):
            f[row + q] = array[p0 + q]


@jit(forceinline=True, borrows=True)
def store_row(p0, m, array, row, f):
    """Copies a scratch row into the array of the pairs p0 .. p0 + m; does nothing for None."""
    if array is not None:
        for q in range(m):
            array[p0 + q] = f[row + q]


@jit(forceinline=True, borrows=True)
def gather_history(p0, m, history, f):
    """Copies the histories of the pairs p0 .. p0 + m into scratch rows."""
    fill_row(p0, m, history.shear, scratch_rows.SHEAR, f)
    fill_row(p0, m, history.reference_gap, scratch_rows.GAP, f)
    fill_row(p0, m, history.bond_state, scratch_rows.BONDED, f)
    fill_row(p0, m, history.rolled, scratch_rows.ROLLED, f)
    fill_row(p0, m, history.root_mass, scratch_rows.ROOT, f)
    fill_parallel_bonds(p0, m, history.parallel, f)


@jit(forceinline=True, borrows=True)
def fill_parallel_bonds(p0, m, parallel, f):
    """Copies the parallel bonds of the pairs p0 .. p0 + m into scratch rows."""
    if parallel is not None:
        fill_row(p0, m, parallel.state, scratch_rows.GLUED, f)
        fill_row(p0, m, parallel.gap, scratch_rows.GLUE_GAP, f)
        fill_row(p0, m, parallel.shear, scratch_rows.GLUE_S, f)
        fill_row(p0, m, parallel.moment, scratch_rows.GLUE_M, f)


@jit(forceinline=True, borrows=True)
def scatter(p0, m, first, second, load, f):
    """Adds forces and moments to both discs of each pair."""
    for q in range(m):
        i, j = first[p0 + q], second[p0 + q]
        px, py = f[scratch_rows.PX + q], f[scratch_rows.PY + q]
        load[i, FX] -= px
        load[i, FY] -= py
        load[i, MOMENT] -= f[scratch_rows.MI + q]
        load[j, FX] += px
        load[j, FY] += py
        load[j, MOMENT] -= f[scratch_rows.MJ + q]


@jit(forceinline=True, borrows=True)
def store_history(p0, m, history, f):
    """Copies scratch rows back into the histories of the pairs p0 .. p0 + m; bond states only if one breaks."""
    store_row(p0, m, history.normal, scratch_rows.FN, f)
    store_row(p0, m, history.shear, scratch_rows.SHEAR, f)
    store_row(p0, m, history.rolled, scratch_rows.ROLLED, f)
    store_parallel_bonds(p0, m, history.parallel, f)


@jit(forceinline=True, borrows=True)
def store_parallel_bonds(p0, m, parallel, f):
    """Copies forces and moments of parallel bonds back."""
    if parallel is not None:
        store_row(p0, m, parallel.normal, scratch_rows.GLUE_N, f)
        store_row(p0, m, parallel.shear, scratch_rows.GLUE_S, f)
        store_row(p0, m, parallel.moment, scratch_rows.GLUE_M, f)


@jit(borrows=True)
def store_bonds(p0, m, bond_state, parallel, counters, f):
    """Copies states of bonds back after some of the pairs p0 .. p0 + m broke, and counts the broken ones."""
    if bond_state is not None:
        store_states(p0, m, bond_state, scratch_rows.BONDED, counters, f)
    if parallel is not None:
        store_states(p0, m, parallel.state, scratch_rows.GLUED, counters, f)


@jit(borrows=True)
def store_states(p0, m, states, row, counters, f):
    """Copies the states of bonds of one kind back, and counts the broken ones."""
    for q in range(m):
        now = np.int8(f[row + q])
        count(states[p0 + q], now, counters)
        states[p0 + q] = now


@jit(borrows=True)
def count(before, now, counters):
    """Counts a bond that broke."""
    if before == BONDED and now == BROKEN_TENSION:
        counters[TENSION_BREAKS] += 1
    if before == BONDED and now == BROKEN_SHEAR:
        counters[SHEAR_BREAKS] += 1
