"""Sides of zones: the boundary of a set of zones, its closed loops, and the connected pieces of the set."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components


def boundary_edges(zones):
    """Sides (E,2) that belong to one zone only, directed with that zone on their left."""
    edges = np.concatenate([zones[:, [k, (k + 1) % 4]] for k in range(4)])
    edges = edges[edges[:, 0] != edges[:, 1]]  # the repeated corner of a triangle
    low, high = np.sort(edges, axis=1).T
    _, first, count = np.unique(low * (zones.max() + 1) + high, return_index=True, return_counts=True)
    return edges[np.sort(first[count == 1])]


def closed_loops(edges):
    """Closed chains [(K,), ..] of gridpoints that the directed `edges` form, each from its smallest index on.

    No gridpoint may be the first of two edges.
    """
    following = dict(zip(*edges.T.tolist(), strict=True))
    loops = []
    while following:
        first = min(following)
        loop, point = [first], following.pop(first)
        while point != first:
            loop.append(point)
            point = following.pop(point)
        loops.append(np.array(loop, dtype=np.int64))
    return loops


def pieces(zones):
    """(A,) number of the connected piece of each of zones (A,4); sides connect zones, single gridpoints do not."""
    sides = np.sort(np.concatenate([zones[:, [k, (k + 1) % 4]] for k in range(4)]), axis=1)
    owner = np.tile(np.arange(len(zones)), 4)
    real = sides[:, 0] != sides[:, 1]  # not the repeated corner of a triangle
    _, side = np.unique(sides[real], axis=0, return_inverse=True)
    zone_by_side = coo_array((np.ones(len(side)), (owner[real], side.ravel())))
    return connected_components(zone_by_side @ zone_by_side.T, directed=False)[1]
