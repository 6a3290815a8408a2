"""Near pairs by cell grids, one for each class of sizes.

In a single grid of cells as wide as the largest disc, a few large discs among many small ones make every cell hold hundreds. So
discs are sorted by size into levels, none wider than `RATIO`, and each level has a grid of its own with cells of

    side = 2 rmax + reach                                                        (1)

(rmax: of that level). A disc looks through the cells of every level that its own circle, widened by rmax + reach, meets: at most
three by three in its own level. Discs of about equal size have one level. Source: Ogarko & Luding (2012), Comput. Phys.
Commun. 183, 931-936.
"""

import numpy as np

from coupler_protocol.jit import jit

RATIO = 5.0  # of largest to smallest radius on a level
CELLS_PER_DISC = 4  # at most: a disc far away must not make the cell grids grow without bound


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
def near_pairs(disc, level, side, widest, body, ring, reach, first, second):
    """Write all pairs i < j of gap < `reach` [m] to `first`, `second`, sorted by both; returns how many there are.

    If there are more than the arrays hold, the rest is only counted.
    """
    n, levels, found = len(disc), len(side), 0
    low, high = disc[0, :2].copy(), disc[0, :2].copy()
    for i in range(n):
        for k in range(2):
            low[k], high[k] = min(low[k], disc[i, k]), max(high[k], disc[i, k])
    columns, rows, offset, width = grids(low, high, side, n)

    # counting sort of the discs by cell, the cells of all levels one behind the other
    cell = np.empty(n, dtype=np.int64)
    start = np.zeros(offset[levels] + 1, dtype=np.int64)
    for i in range(n):
        w, k = width[level[i]], level[i]
        cell[i] = offset[k] + int((disc[i, 1] - low[1]) / w) * columns[k] + int((disc[i, 0] - low[0]) / w)
        start[cell[i] + 1] += 1
    for c in range(offset[levels]):
        start[c + 1] += start[c]
    place, order = start[:-1].copy(), np.empty(n, dtype=np.int64)
    for i in range(n):
        order[place[cell[i]]] = i
        place[cell[i]] += 1

    for i in range(n):
        begin = found
        x, y, r = disc[i, 0], disc[i, 1], disc[i, 5]
        for k in range(levels):
            w, far = width[k], r + widest[k] + reach
            c0, c1 = max(int((x - far - low[0]) / w), 0), min(int((x + far - low[0]) / w), columns[k] - 1)
            r0, r1 = max(int((y - far - low[1]) / w), 0), min(int((y + far - low[1]) / w), rows[k] - 1)
            for row in range(r0, r1 + 1):
                here = offset[k] + row * columns[k]
                for q in range(start[here + c0], start[here + c1 + 1]):
                    j = order[q]
                    if j <= i or j < ring:
                        continue
                    dx, dy, near = disc[j, 0] - x, disc[j, 1] - y, r + disc[j, 5] + reach
                    if dx * dx + dy * dy >= near * near:
                        continue
                    if body is not None:  # noqa: SIM102 (numba prunes this line only if it stands alone)
                        if body[i] >= 0 and body[i] == body[j]:
                            continue
                    if found < len(first):
                        # in its place among the pairs of disc i
                        p = found
                        while p > begin and second[p - 1] > j:
                            second[p] = second[p - 1]
                            p -= 1
                        second[p] = j
                        first[found] = i
                    found += 1
    return found


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
