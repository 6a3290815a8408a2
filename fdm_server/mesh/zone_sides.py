"""Sides of zones: the boundary of a set of zones, its closed loops, and the connected pieces of the set."""

import numpy as np


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


def open_chains(edges):
    """Open chains [(K,), ..] of gridpoints that the directed `edges` form, by their first gridpoints; not the loops.

    No gridpoint may be the first of two edges, nor the second of two.
    """
    following = dict(zip(*edges.T.tolist(), strict=True))
    chains = []
    for first in sorted(set(following) - set(following.values())):
        chain = [first]
        while chain[-1] in following:
            chain.append(following.pop(chain[-1]))
        chains.append(np.array(chain, dtype=np.int64))
    return chains


def pieces(zones):
    """(A,) number of the connected piece of each of zones (A,4); sides connect zones, single gridpoints do not."""
    sides = np.sort(np.concatenate([zones[:, [k, (k + 1) % 4]] for k in range(4)]), axis=1)
    owner = np.tile(np.arange(len(zones)), 4)
    real = sides[:, 0] != sides[:, 1]  # not the repeated corner of a triangle
    low, high = sides[real].T
    side = low * (zones.max() + 1) + high
    order = np.argsort(side, kind="stable")
    shared = side[order][1:] == side[order][:-1]
    return _components(len(zones), owner[real][order][:-1][shared], owner[real][order][1:][shared])


def _components(count, a, b):
    """(count,) number of the connected component of each node of a graph with links a-b (L,), in order of their first nodes.

    Every node points to a node of its component that is not larger. In each round the targets of both ends of a link take the
    smaller target, and targets are followed one step further, until all nodes point to the smallest node of their component
    (Zhang, Azad & Buluc 2020, Parallel Algorithms for Finding Connected Components using Linear Algebra, J. Parallel Distrib.
    Comput. 144). scipy has this too, but its import takes longer than all that a small grid computes at its start.
    """
    target = np.arange(count)
    while True:
        before = target.copy()
        least = np.minimum(before[a], before[b])
        for ends in (a, b):
            np.minimum.at(target, before[ends], least)
            np.minimum.at(target, ends, least)
        target = np.minimum(target, target[target])
        if np.array_equal(target, before):
            return np.unique(target, return_inverse=True)[1]
