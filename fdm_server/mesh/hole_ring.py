"""Zones around a circular hole: radial lines at equal angles, and circles whose distance grows outwards.

Without a growth ratio the radii of circles are r_k = a (b/a)^(k/n), which makes all zones about square: n is ln(b/a) over the
angle of a zone, rounded. With a ratio g, radial sizes are h, h g, h g^2, ..., h being about the width of the zones at the wall.
"""

from math import log, log1p, pi

import numpy as np

ANGLES = {"full": 2.0 * pi, "half": pi, "quarter": 0.5 * pi}


def ring_mesh(g):
    """Gridpoints xy (N,2) [m], zones (Z,4), column (counter-clockwise) and row (outwards) (Z,) of the table [grid]."""
    angle = ANGLES[g.part] / g.around
    radius = circles(g.inner, g.outer, angle, g.growth)
    spokes = g.around + (g.part != "full")
    theta = angle * np.arange(spokes)
    direction = np.column_stack([np.cos(theta), np.sin(theta)])
    direction[np.abs(direction) < 1e-12] = 0.0  # the symmetry sides are exactly on the axes
    xy = (radius[:, None, None] * direction).reshape(-1, 2)
    row, column = (index.ravel() for index in np.indices((len(radius) - 1, g.around)))
    a, b = row * spokes + column, row * spokes + (column + 1) % spokes
    return xy, np.column_stack([a, a + spokes, b + spokes, b]), column, row


def circles(inner, outer, angle, growth=None):
    """Radii (n+1,) [m] of the circles, for zones of `angle` [rad]."""
    if growth is None:
        n = max(1, round(log(outer / inner) / angle))
        radius = inner * (outer / inner) ** (np.arange(n + 1) / n)
    else:
        depth = (outer - inner) / (inner * angle)  # in zones of the first size
        n = max(1, round(depth if growth == 1.0 else log1p(depth * (growth - 1.0)) / log(growth)))
        steps = np.concatenate([[0.0], np.cumsum(growth ** np.arange(n))])
        radius = inner + (outer - inner) * steps / steps[-1]
    radius[0], radius[-1] = inner, outer
    return radius
