"""Neighbour list: near pairs in slots, found with a cell grid, valid until a disc has moved by half the skin.

A pair closer than `SKIN` smallest radii gets a slot at its lower-numbered disc or, if that one is full, at
the other; pairs within the ring or within one clump never do. Rebuilding carries forces, reference gaps and bonds over; bonded
pairs stay listed at any distance.
"""

import numpy as np

from coupler_protocol.jit import jit
from dem_server.effects.bond import BONDED
from dem_server.effects.parallel_bond import ParallelBonds
from dem_server.model import BUILDS
from dem_server.timestep import set_masses

SKIN = 0.3  # of the smallest radius
HISTORY = ("bond_state", "reference_gap", "normal", "shear", "rolled")  # fields of State kept from list to list
CELLS_PER_DISC = 4  # at most: a disc far away must not make the cell grid grow without bound


def skin(model):
    """Largest gap of a listed pair [m]."""
    return SKIN * model.smallest_radius


def rebuild(model, state):
    """Build the list anew, widen the slots if they do not suffice, and recompute masses and the time step."""
    if not np.isfinite(state.disc).all():
        lost = int(np.flatnonzero(~np.isfinite(state.disc).all(axis=1))[0])
        raise ArithmeticError(f"disc {lost}: position or velocity is no longer a number")
    slots = state.partner.shape[1]
    used, partner, old, bonds = state.used, state.partner, history(state), state.parallel
    body = None if state.clumps is None else state.clumps.body
    while True:
        state.used, state.partner = np.zeros_like(used), np.zeros((model.count, slots), dtype=partner.dtype)
        new, new_bonds = like(old, slots), None if bonds is None else ParallelBonds(*like(bonds, slots))
        if (
            list_pairs(state.disc, state.listed_at, body, model.ring, skin(model), state.used, state.partner)
            and carry_over(used, partner, *old, body, state.used, state.partner, *new)
            and (bonds is None or carry_over(used, partner, *bonds, body, state.used, state.partner, *new_bonds))
        ):
            break
        slots += 2
    for name, array in zip(HISTORY, new, strict=True):
        setattr(state, name, array)
    state.parallel = new_bonds
    state.kind = np.zeros_like(state.partner)
    number_kinds(state.used, state.partner, state.kind, model.material, model.materials)
    if state.root_mass is not None:
        state.root_mass = np.zeros((model.count, slots))
    set_masses(model, state)
    state.counters[BUILDS] += 1


def history(state):
    """What the slots remember, in the order of HISTORY, which is that of ParallelBonds too."""
    return [getattr(state, name) for name in HISTORY]


def like(arrays, slots):
    """Zeros in the place of each array, `slots` wide."""
    return [None if a is None else np.zeros((len(a), slots), dtype=a.dtype) for a in arrays]


@jit
def list_pairs(disc, listed_at, body, ring, reach, used, partner):
    """Fill `used` (n,) and `partner` (n, S) with all pairs of gap < `reach`; False if slots are short."""
    n = disc.shape[0]
    x0, y0, x1, y1, widest = disc[0, 0], disc[0, 1], disc[0, 0], disc[0, 1], 0.0
    for i in range(n):
        listed_at[i, 0], listed_at[i, 1] = disc[i, 0], disc[i, 1]
        x0, x1 = min(x0, disc[i, 0]), max(x1, disc[i, 0])
        y0, y1 = min(y0, disc[i, 1]), max(y1, disc[i, 1])
        widest = max(widest, disc[i, 5])
    side = 2.0 * widest + reach
    while ((x1 - x0) / side + 1.0) * ((y1 - y0) / side + 1.0) > CELLS_PER_DISC * n + 64.0:
        side *= 2.0
    columns, rows = int((x1 - x0) / side) + 1, int((y1 - y0) / side) + 1

    # counting sort of the discs by cell
    cell = np.empty(n, dtype=np.int64)
    start = np.zeros(columns * rows + 1, dtype=np.int64)
    for i in range(n):
        cell[i] = int((disc[i, 1] - y0) / side) * columns + int((disc[i, 0] - x0) / side)
        start[cell[i] + 1] += 1
    for c in range(columns * rows):
        start[c + 1] += start[c]
    place = start[:-1].copy()
    order = np.empty(n, dtype=np.int64)
    for i in range(n):
        order[place[cell[i]]] = i
        place[cell[i]] += 1

    # each cell against itself and four of its neighbours: right, and the three above
    for row in range(rows):
        for column in range(columns):
            here = row * columns + column
            for p in range(start[here], start[here + 1]):
                i = order[p]
                right = start[here + 2] if column + 1 < columns else start[here + 1]
                if not list_near(disc, body, ring, reach, order, i, p + 1, right, used, partner):
                    return False
                if row + 1 < rows:
                    above = here + columns
                    first = start[above - 1] if column > 0 else start[above]
                    last = start[above + 2] if column + 1 < columns else start[above + 1]
                    if not list_near(disc, body, ring, reach, order, i, first, last, used, partner):
                        return False
    return True


@jit
def list_near(disc, body, ring, reach, order, i, first, last, used, partner):
    """List disc `i` with those of order[first:last] that are near; False if slots are short."""
    for q in range(first, last):
        j = order[q]
        if body is not None:  # noqa: SIM102 (numba prunes this line only if it stands alone)
            if same_clump(i, j, body):
                continue
        dx, dy = disc[j, 0] - disc[i, 0], disc[j, 1] - disc[i, 1]
        near = disc[i, 5] + disc[j, 5] + reach
        if (
            dx * dx + dy * dy < near * near
            and (i >= ring or j >= ring)
            and not add_pair(min(i, j), max(i, j), used, partner)
        ):
            return False
    return True


@jit
def same_clump(i, j, body):
    """Whether two discs belong to one rigid body; body (n,): its number, -1 without one."""
    return body[i] >= 0 and body[i] == body[j]


@jit
def add_pair(i, j, used, partner):
    """Give the pair a slot at `i` or else at `j`; False if both are full."""
    if used[i] == partner.shape[1]:
        i, j = j, i
        if used[i] == partner.shape[1]:
            return False
    partner[i, used[i]] = j
    used[i] += 1
    return True


@jit
def find_pair(i, j, used, partner):
    """Disc that holds the pair, and its slot there; slot -1 if the pair is not listed."""
    for a, b in ((i, j), (j, i)):
        for s in range(used[a]):
            if partner[a, s] == b:
                return a, s
    return i, -1


@jit
def carry_over(
    old_used, old_partner, old_bond, old_gap, old_normal, old_shear, old_moment, body,
    used, partner, bond, gap, normal, shear, moment,
):  # fmt: skip
    """Copy what the old slots knew, list bonded pairs that are missing; False if slots are short.

    Moments act on the second disc of a pair: where the pair changes hands they change sign.
    """
    for a in range(len(old_used)):
        for o in range(old_used[a]):
            b = np.int64(old_partner[a, o])
            if body is not None:  # noqa: SIM102 (numba prunes this line only if it stands alone)
                if same_clump(a, b, body):
                    continue
            i, s = find_pair(a, b, used, partner)
            if old_bond is not None:  # noqa: SIM102 (numba prunes this line only if it stands alone)
                if s < 0 and old_bond[a, o] == BONDED:
                    if not add_pair(a, b, used, partner):
                        return False
                    i, s = find_pair(a, b, used, partner)
            if s < 0:
                continue
            normal[i, s] = old_normal[a, o]
            if shear is not None:
                shear[i, s] = old_shear[a, o]
            if gap is not None:
                gap[i, s] = old_gap[a, o]
            if bond is not None:
                bond[i, s] = old_bond[a, o]
            if moment is not None:
                moment[i, s] = old_moment[a, o] if i == a else -old_moment[a, o]
    return True


@jit
def number_kinds(used, partner, kind, material, materials):
    """Number of the kind of pair of every listed pair."""
    for i in range(len(used)):
        for s in range(used[i]):
            kind[i, s] = material[i] * materials + material[partner[i, s]]
