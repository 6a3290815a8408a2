"""Forces at gridpoints of loads that are uniform over parts of sides.

A pressure p on a part xi_0..xi_1 of a side of length l acts on its two ends with p l (d - m) and p l m, with d = xi_1 - xi_0,
m = (xi_1^2 - xi_0^2)/2.
"""

import numpy as np

FLAT = 1e-12  # largest inclination, over its length, of a side that counts as normal to an axis


def forces_of_even_loads(xy, edges, push, x=None, y=None):
    """Forces (N,2) [N] at gridpoints xy (N,2) of loads `push` (E,2) [N], uniform over the parts of sides (E,2) within x, y."""
    a, b = xy[edges[:, 0]], xy[edges[:, 1]]
    along = b - a
    first, last = np.zeros(len(edges)), np.ones(len(edges))
    for axis, span in enumerate((x, y)):
        if span is None:
            continue
        flat = np.abs(along[:, axis]) <= FLAT * np.abs(along).max(axis=1)
        way = np.where(flat, 1.0, along[:, axis])
        low, high = (span[0] - a[:, axis]) / way, (span[1] - a[:, axis]) / way
        inside = (a[:, axis] >= span[0]) & (a[:, axis] <= span[1])
        first = np.where(flat, np.where(inside, first, 1.0), np.maximum(first, np.clip(np.minimum(low, high), 0.0, 1.0)))
        last = np.where(flat, last, np.minimum(last, np.clip(np.maximum(low, high), 0.0, 1.0)))
    part, moment = np.maximum(last - first, 0.0), np.where(last > first, 0.5 * (last**2 - first**2), 0.0)
    force = np.zeros_like(xy)
    np.add.at(force, edges[:, 0], push * (part - moment)[:, None])
    np.add.at(force, edges[:, 1], push * moment[:, None])
    return force
