"""Lines of a net of unequal cells: through given stops, and with distances that grow towards the sides.

Outside the fine range [a, b] a line at distance s from it has the number

    t = ln(1 + (r - 1) s/h) / ln r        beyond that of the range's end,

h the size of a zone in the range: lines at whole t enclose zones of h, h r, h r^2, ... Between two stops the lines have equal
steps of t, whose number is rounded.
"""

from itertools import pairwise
from math import expm1, log, log1p

import numpy as np

NEAREST = 0.5  # smallest distance of two stops, in zones; closer stops share a line


def net_lines(extent, size, stops, fine=None, ratio=1.0):
    """Lines (n+1,) [m] of a net from 0 to `extent`, about `size` apart in the range `fine` (none: everywhere)."""
    first, last = (0.0, extent) if fine is None else (max(fine[0], 0.0), min(fine[1], extent))
    growth = ratio - 1.0

    def number(x):
        if x < first:
            return -log1p(growth * (first - x) / size) / log(ratio)
        if x > last:
            return (last - first) / size + log1p(growth * (x - last) / size) / log(ratio)
        return (x - first) / size

    def position(t):
        if t < 0.0:
            return first - size * expm1(-t * log(ratio)) / growth
        beyond = t - (last - first) / size
        return last + size * expm1(beyond * log(ratio)) / growth if beyond > 0.0 else first + size * t

    lines = [0.0]
    for a, b in pairwise(_thinned([*stops, first, last], extent, size)):
        ta, tb = number(a), number(b)
        count = max(1, round(tb - ta))
        if fine is None:
            lines += [a + (b - a) * k / count for k in range(1, count)]
        else:
            lines += [position(ta + (tb - ta) * k / count) for k in range(1, count)]
        lines.append(b)
    return np.array(lines)


def _thinned(stops, extent, size):
    """Stops from 0 to `extent` in order, at least NEAREST zones apart: their middle replaces the closest two, ends stay."""
    at = sorted({0.0, extent, *(s for s in stops if 0.0 < s < extent)})
    while len(at) > 2 and min(gaps := [b - a for a, b in pairwise(at)]) < NEAREST * size:
        k = gaps.index(min(gaps))
        middle = 0.0 if k == 0 else extent if k + 2 == len(at) else 0.5 * (at[k] + at[k + 1])
        at[k : k + 2] = [middle]
    return at
