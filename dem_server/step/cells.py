"""Near pairs by cell grids, one for each class of sizes.

In a single grid of cells as wide as the largest disc, with a few large discs among many small ones, every cell would contain
hundreds of discs. So discs are sorted by size into levels with a size ratio of at most `RATIO`, and each level has a separate
grid with cells of

    side = 2 rmax + reach                                                        (1)

(rmax: of that level). A disc is tested against the discs of its own cell and of four neighbouring cells, and on every level of
smaller discs against those of the cells that its circle, enlarged by rmax + reach, intersects. Discs of about equal size have
one level. Source: Ogarko & Luding (2012), Comput. Phys. Commun. 183, 931-936.
"""

import numpy as np

from coupler_protocol.compiled.jit import jit
from dem_server.model import RADIUS, X, Y

RATIO = 5.0  # of largest to smallest radius on a level
CELLS_PER_DISC = 4  # upper limit: a disc far away must not increase the cell grids without limit


def levels_of(radius, reach):
    """Level (n,) of each disc, cell side (L,) [m] and largest radius (L,) [m] of each level, the smallest discs first."""
    smallest, largest = float(radius.min()), float(radius.max())
    count = max(1, int(np.ceil(np.log(largest / smallest) / np.log(RATIO) - 1e-9)))
    if count == 1:
        return np.zeros(len(radius), dtype=np.int64), np.array([2.0 * largest + reach]), np.array([largest])
    edge = smallest * (largest / smallest) ** (np.arange(1, count) / count)
    found, level = np.unique(np.searchsorted(edge, radius), return_inverse=True)
    widest = np.array([radius[level == k].max() for k in range(len(found))])
    return level.astype(np.int64), 2.0 * widest + reach, widest


@jit
def near_pairs(disc, level, side, widest, body, ring, reach, a, b):
    """Writes all pairs with gap < `reach` [m], lower number first, to a, b without order; returns their number.

    Pairs within the ring or within one body (n,) are left out; without bodies `body` has no elements. Pairs beyond the length of
    a and b are only counted.
    """
    n, levels = len(disc), len(side)
    low, high = disc[0, :2].copy(), disc[0, :2].copy()
    for i in range(n):
        for k in range(2):
            low[k], high[k] = min(low[k], disc[i, k]), max(high[k], disc[i, k])
    columns, rows, offset, width = grids(low, high, side, n)

    # counting sort of the discs by cell; the cells of all levels follow one another
    cell, column_of = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    start = np.zeros(offset[levels] + 1, dtype=np.int64)
    for i in range(n):
        w, k = width[level[i]], level[i]
        column_of[i] = int((disc[i, X] - low[0]) / w)
        cell[i] = offset[k] + int((disc[i, Y] - low[1]) / w) * columns[k] + column_of[i]
        start[cell[i] + 1] += 1
    for c in range(offset[levels]):
        start[c + 1] += start[c]
    place, order, at = start[:-1].copy(), np.empty(n, dtype=np.int64), np.empty((n, 3))
    for i in range(n):
        q = place[cell[i]]
        order[q], at[q, 0], at[q, 1], at[q, 2] = i, disc[i, X], disc[i, Y], disc[i, RADIUS]
        place[cell[i]] += 1

    found = np.int64(0)  # for a literal number numba would compile `near_in` once more
    for p in range(n):
        i, x, y, r = order[p], at[p, 0], at[p, 1], at[p, 2]
        own = level[i]
        # its own level: the rest of its cell and the one to the right, and the three above
        column = column_of[i]
        last, here = min(column + 1, columns[own] - 1), cell[i] - column
        found = near_in(p + 1, start[here + last + 1], x, y, r, i, order, at, body, ring, reach, a, b, found)
        here += columns[own]
        if here < offset[own + 1]:
            first = start[here + max(column - 1, 0)]
            found = near_in(first, start[here + last + 1], x, y, r, i, order, at, body, ring, reach, a, b, found)
        # levels of smaller discs: all cells that its enlarged circle intersects
        for k in range(own):
            w, far = width[k], r + widest[k] + reach
            c0, c1 = max(int((x - far - low[0]) / w), 0), min(int((x + far - low[0]) / w), columns[k] - 1)
            r0, r1 = max(int((y - far - low[1]) / w), 0), min(int((y + far - low[1]) / w), rows[k] - 1)
            for row in range(r0, r1 + 1):
                here = offset[k] + row * columns[k]
                first, end = start[here + c0], start[here + c1 + 1]
                found = near_in(first, end, x, y, r, i, order, at, body, ring, reach, a, b, found)
    return found


@jit(forceinline=True)
def near_in(first, end, x, y, r, i, order, at, body, ring, reach, a, b, found):
    """Writes the near pairs of disc i, at (x, y) with radius r, with discs of order[first:end]; returns the new count.

    Every candidate is written and only a near one counted: whether a pair is near cannot be predicted.
    """
    for q in range(first, end):
        j = order[q]
        dx, dy, near = at[q, 0] - x, at[q, 1] - y, r + at[q, 2] + reach
        counts = (dx * dx + dy * dy < near * near) & ((i >= ring) | (j >= ring))
        if len(body) > 0:
            counts &= (body[i] < 0) | (body[i] != body[j])
        if found < len(a):
            a[found], b[found] = min(i, j), max(i, j)
        found += counts
    return found


@jit
def sorted_pairs(n, found, a, b):
    """The first `found` pairs of discs below n, sorted by first and second disc: (found,), (found,)."""
    start = np.zeros(n + 1, dtype=np.int64)
    for p in range(found):
        start[a[p] + 1] += 1
    for i in range(n):
        start[i + 1] += start[i]
    first, second, place = np.empty(found, dtype=np.uint32), np.empty(found, dtype=np.uint32), start[:-1].copy()
    for p in range(found):
        i, j = a[p], b[p]
        q = place[i]
        place[i] += 1
        while q > start[i] and second[q - 1] > j:
            second[q] = second[q - 1]
            q -= 1
        second[q], first[place[i] - 1] = j, i
    return first, second


@jit
def grids(low, high, side, n):
    """Columns, rows (L,), first cell (L + 1,) and cell width (L,) of each level's grid over the rectangle low..high."""
    levels = len(side)
    columns, rows = np.empty(levels, dtype=np.int64), np.empty(levels, dtype=np.int64)
    offset, width = np.zeros(levels + 1, dtype=np.int64), side.copy()
    for k in range(levels):
        while ((high[0] - low[0]) / width[k] + 1.0) * ((high[1] - low[1]) / width[k] + 1.0) > CELLS_PER_DISC * n + 64.0:
            width[k] *= 2.0
        columns[k], rows[k] = int((high[0] - low[0]) / width[k]) + 1, int((high[1] - low[1]) / width[k]) + 1
        offset[k + 1] = offset[k] + columns[k] * rows[k]
    return columns, rows, offset, width
