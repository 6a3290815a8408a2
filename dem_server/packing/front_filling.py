"""Boundary inward filling: a front of discs advances from the ring into the window.

Every new disc touches two existing discs, first those of the ring, then those of the layers that grow on it.
Pairs wait in a queue in the order in which they form; of the next radii the first one that fits is taken.
With discs a, b and the new radius r (Feng, Han & Owen 2003, Int. J. Numer. Meth. Engng 56, 699-713):

    u = ra + r,  w = rb + r,  s = (d^2 + u^2 - w^2) / 2d,  h = sqrt(u^2 - s^2)   (1)
    x = xa + s e ± h k x e                                                       (2)

where e points from a to b at the distance d. The filling ends when no pair has room for any of the next radii.
Source of the procedure: Study on Failure Mechanism of Soil-Rock Slope with FDM-DEM Method (2022), section 4.2.
"""

import numpy as np

from coupler_protocol.compiled.jit import jit
from dem_server.stones.overlap import inside

CHOICE = 8  # radii a pair may choose from
PAIRS = 32  # room in the queue, per disc
TOUCHING = 1e-9  # overlap of smallest radii that counts as touching


def fill(polygon, ring_xy, ring_radius, radii):
    """Centres (n, 2) and radii (n,) of discs that fill the polygon (P, 2) inside its ring; radii: to choose from."""
    R = len(ring_xy)
    xy = np.vstack([ring_xy, np.zeros((len(radii), 2))])
    radius = np.concatenate([ring_radius, radii])
    placed = advance(np.ascontiguousarray(polygon, dtype=float), xy, radius, R)
    return xy[R:placed].copy(), radius[R:placed].copy()


@jit
def advance(polygon, xy, radius, ring):
    """Places discs from number `ring` on, one by one; returns the number of discs with the ring."""
    count, largest, smallest = ring, radius.max(), radius.min()
    side = 2.0 * largest
    low = np.array([xy[:ring, 0].min(), xy[:ring, 1].min()]) - side
    columns = int((xy[:ring, 0].max() - low[0]) / side) + 2
    rows = int((xy[:ring, 1].max() - low[1]) / side) + 2
    first, after = np.full(columns * rows, -1), np.full(len(xy), -1)
    pairs = np.empty((PAIRS * len(xy), 2), dtype=np.int64)
    waiting = 0
    for i in range(ring):
        enter(i, xy, low, side, columns, first, after)
        pairs[i, 0], pairs[i, 1] = i, i + 1 if i + 1 < ring else 0
        waiting += 1
    turn = 0
    while turn < waiting and count < len(xy):
        if place(pairs[turn, 0], pairs[turn, 1], count, polygon, xy, radius, smallest, low, side, columns, first, after):
            enter(count, xy, low, side, columns, first, after)
            waiting = pair_up(count, xy, radius, largest, low, side, columns, first, after, pairs, waiting)
            count += 1
        else:
            turn += 1
    return count


@jit
def enter(i, xy, low, side, columns, first, after):
    """Enters disc i into the cell grid, in which each cell has a chain of discs."""
    cell = int((xy[i, 1] - low[1]) / side) * columns + int((xy[i, 0] - low[0]) / side)
    after[i], first[cell] = first[cell], i


@jit
def place(a, b, new, polygon, xy, radius, smallest, low, side, columns, first, after):
    """Places disc `new` in contact with a and b, Eqs (1) and (2), with one of the next radii; returns False if none fits."""
    dx, dy = xy[b, 0] - xy[a, 0], xy[b, 1] - xy[a, 1]
    d = (dx * dx + dy * dy) ** 0.5
    ex, ey = dx / d, dy / d
    for choice in range(new, min(new + CHOICE, len(radius))):
        r = radius[choice]
        u, w = radius[a] + r, radius[b] + r
        s = (d * d + u * u - w * w) / (2.0 * d)
        if u * u < s * s:
            continue
        for h in ((u * u - s * s) ** 0.5, -((u * u - s * s) ** 0.5)):
            x, y = xy[a, 0] + s * ex - h * ey, xy[a, 1] + s * ey + h * ex
            if inside(polygon, len(polygon), x, y) and clear(
                x, y, r - TOUCHING * smallest, xy, radius, low, side, columns, first, after
            ):
                xy[new, 0], xy[new, 1] = x, y
                radius[choice], radius[new] = radius[new], r
                return True
    return False


@jit
def clear(x, y, r, xy, radius, low, side, columns, first, after):
    """Whether a disc overlaps none of those in the grid."""
    column, row = int((x - low[0]) / side), int((y - low[1]) / side)
    for cy in range(row - 1, row + 2):
        for cx in range(column - 1, column + 2):
            j = first[cy * columns + cx]
            while j >= 0:
                if (xy[j, 0] - x) ** 2 + (xy[j, 1] - y) ** 2 < (radius[j] + r) ** 2:
                    return False
                j = after[j]
    return True


@jit
def pair_up(i, xy, radius, largest, low, side, columns, first, after, pairs, waiting):
    """Adds pairs of disc i with all discs so near that the largest disc could touch both; returns the end of the queue."""
    column, row = int((xy[i, 0] - low[0]) / side), int((xy[i, 1] - low[1]) / side)
    rows = len(first) // columns
    for cy in range(max(row - 2, 0), min(row + 3, rows)):
        for cx in range(max(column - 2, 0), min(column + 3, columns)):
            j = first[cy * columns + cx]
            while j >= 0:
                far = radius[i] + radius[j] + 2.0 * largest
                near = (xy[j, 0] - xy[i, 0]) ** 2 + (xy[j, 1] - xy[i, 1]) ** 2 < far * far
                if j != i and near and waiting < len(pairs):
                    pairs[waiting, 0], pairs[waiting, 1] = j, i
                    waiting += 1
                j = after[j]
    return waiting
