"""Sides of zones: which ones bound a set of zones, and the loop they form."""

import numpy as np


def boundary_edges(zones):
    """Sides (E,2) that belong to one zone only, directed with that zone on their left."""
    edges = np.concatenate([zones[:, [k, (k + 1) % 4]] for k in range(4)])
    edges = edges[edges[:, 0] != edges[:, 1]]  # the repeated corner of a triangle
    low, high = np.sort(edges, axis=1).T
    _, first, count = np.unique(low * (zones.max() + 1) + high, return_index=True, return_counts=True)
    return edges[np.sort(first[count == 1])]


def closed_loop(edges):
    """Gridpoints (K,) of the one closed chain that the directed `edges` form, from the smallest index on.

    Raises ValueError where they form several loops or meet in a point.
    """
    start, end = edges[:, 0], edges[:, 1]
    if len(np.unique(start)) != len(start):
        raise ValueError("its zones meet in a single gridpoint: join them by a side or take them apart")
    following = dict(zip(start.tolist(), end.tolist(), strict=True))
    loop = [min(following)]
    while (point := following[loop[-1]]) != loop[0]:
        loop.append(point)
    if len(loop) != len(edges):
        raise ValueError("its zones are not one piece without holes")
    return np.array(loop, dtype=np.int64)
