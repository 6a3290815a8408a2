"""Neighbour list: near pairs, found with cell grids, valid until a disc has moved by half the skin.

A pair closer than `SKIN` smallest radii is listed; pairs within the ring or within one clump are not. A new list takes over
forces, reference gaps and bonds of the old one; bonded pairs stay listed at any distance. Breaks of bonds are collected before.

The list is sorted by first, then second disc. Free discs are numbered in space, in runs of `RUN`: nearly all pairs of the discs
of a run are with discs of the same run or the next one, so every other run can be summed at the same time and no disc gets
forces from two threads. `parts` has that order: pairs of the ring, runs 0, 2, 4, .., runs 1, 3, 5, .., and finally the pairs of
discs whose numbers are farther apart, at the end of the list. It does not depend on the number of threads.
"""

import numpy as np

from coupler_protocol.compiled.jit import jit
from dem_server.effects.bond import BONDED
from dem_server.effects.histories import carry_to_new_list
from dem_server.model import BUILDS
from dem_server.step.breaks import collect
from dem_server.step.cells import levels_of, near_pairs, sorted_pairs
from dem_server.step.masses import set_masses
from dem_server.step.thread_shares import RUN

SKIN = 0.3  # of the smallest radius
FAR = np.int64(1) << 62  # added to the key of a pair of distant numbers
NO_BODIES = np.empty(0, dtype=np.int32)


def skin(model):
    """Largest gap of a listed pair [m]."""
    return SKIN * model.smallest_radius


def rebuild(model, state):
    """Builds a new list, and recomputes masses and the time step; raises ArithmeticError for positions that are NaN."""
    if not np.isfinite(state.disc).all():
        lost = int(np.flatnonzero(~np.isfinite(state.disc).all(axis=1))[0])
        raise ArithmeticError(f"position or velocity of disc {lost} is NaN or infinite")
    collect(state)
    state.listed_at[:] = state.x
    old, (first, second, key) = keys(model, state.first, state.second), found_near(model, state)
    origin = places(old, key)
    lost = still_bonded(model, state, origin)
    if len(lost):
        key = np.concatenate([key, old[lost]])
        order = np.argsort(key)
        key, origin = key[order], np.concatenate([origin, lost])[order]
        first, second = np.concatenate([first, state.first[lost]])[order], np.concatenate([second, state.second[lost]])[order]
    state.first, state.second = first, second
    state.parts = parts_of(model, state.first, key)
    carry_to_new_list(state, origin)
    state.kind = kinds(model.material, model.materials, state.first, state.second)
    set_masses(model, state)
    state.counters[BUILDS] += 1


def found_near(model, state):
    """First disc, second disc and key (m,) of all pairs with a gap smaller than the skin, sorted by the key."""
    body = NO_BODIES if state.clumps is None else state.clumps.body
    level, side, widest = levels_of(state.radius, skin(model))
    room = 4 * model.count + 64
    while True:
        a, b = np.empty(room, dtype=np.uint32), np.empty(room, dtype=np.uint32)
        found = near_pairs(state.disc, level, side, widest, body, model.ring, skin(model), a, b)
        if found <= room:
            break
        room = found
    first, second = sorted_pairs(model.count, found, a, b)
    key = keys(model, first, second)
    far = key >= FAR
    if not far.any():
        return first, second, key
    return tuple(np.concatenate([array[~far], array[far]]) for array in (first, second, key))


def keys(model, first, second):
    """Keys (m,) by which the list is sorted: one for each pair, those of distant numbers last."""
    return _keys(first, second, np.int64(model.ring), np.int64(model.count))


@jit
def _keys(first, second, ring, count):
    key = np.empty(len(first), dtype=np.int64)
    for p in range(len(first)):
        i, j = np.int64(first[p]), np.int64(second[p])
        key[p] = i * count + j
        if i >= ring and (j - ring) // RUN > (i - ring) // RUN + 1:
            key[p] += FAR
    return key


@jit
def places(old, new):
    """Position (m,) of each key of `new` in `old`, -1 if `old` does not contain it; both are sorted."""
    origin, o = np.full(len(new), -1, dtype=np.int64), 0
    for p in range(len(new)):
        while o < len(old) and old[o] < new[p]:
            o += 1
        if o < len(old) and old[o] == new[p]:
            origin[p] = o
    return origin


def still_bonded(model, state, origin):
    """Positions in the old list of bonded pairs that are not near; bonds within a clump are dropped."""
    parallel = None if state.parallel is None else state.parallel.state
    body = None if state.clumps is None else state.clumps.body
    return _still_bonded(origin, state.bond_state, parallel, body, state.first, state.second)


@jit
def _still_bonded(origin, bond, parallel, body, first, second):
    bonded = np.zeros(len(first), dtype=np.bool_)
    for p in range(len(first)):
        if bond is not None:
            bonded[p] |= bond[p] == BONDED
        if parallel is not None:
            bonded[p] |= parallel[p] == BONDED
        if body is not None:
            bonded[p] &= body[first[p]] < 0 or body[first[p]] != body[second[p]]
    for o in origin:
        if o >= 0:
            bonded[o] = False
    return np.flatnonzero(bonded)


def parts_of(model, first, key):
    """Runs of the list (P, 2), first and last pair + 1, in the order in which they are summed; see above."""
    return _parts(first, key, model.ring, model.count - model.ring)


@jit
def _parts(first, key, ring, free):
    near = np.searchsorted(key, FAR)
    runs = max(1, -(-free // RUN))
    parts = np.empty((runs + 2, 2), dtype=np.uint64)
    row = 0
    for begin in (0, 1, 2):  # pairs of the ring, runs 0, 2, 4, .. (numbers 1, 3, 5, ..), runs 1, 3, 5, ..
        for number in range(begin, 1 if begin == 0 else runs + 1, 2):
            parts[row, 0] = 0 if number == 0 else np.searchsorted(first[:near], ring + RUN * (number - 1))
            parts[row, 1] = near if number == runs else np.searchsorted(first[:near], ring + RUN * number)
            row += 1
    parts[row, 0], parts[row, 1] = near, len(key)
    return parts


def kinds(material, materials, first, second):
    """Number of the kind of pair (m,) of every listed pair; material (n,)."""
    return _kinds(material, materials, first, second)


@jit
def _kinds(material, materials, first, second):
    kind = np.empty(len(first), dtype=np.uint32)
    for p in range(len(first)):
        kind[p] = material[first[p]] * materials + material[second[p]]
    return kind
