"""Stress of a packing from its contacts (tension positive): branch x force over area.

    sigma = -(1/A) sum_c w_c  sym(F_c (x) l_c)                                   (1)

F_c: force on body b, l_c: branch from the centroid of body a (a disc or a clump) to that of b, w_c: share of
the branch inside the region of area A. Control discs are on the edge of the window, so with all branches and
the area of the window (1) is exactly the mean stress of the window at rest. Sources: Weber (1966), Bull. Liaison
Ponts et Chaussées 20; Christoffersen, Mehrabadi & Nemat-Nasser (1981), J. Appl. Mech. 48, 339-344.
"""

import numpy as np

from coupler_protocol.geometry import share_inside
from dem_server.pairs import moments_along


def contact_moments(pairs):
    """Integral of stress along each contact's branch: -sym(F (x) l) as columns xx, yy, xy (m, 3) [N m]."""
    return moments_along(pairs.force, pairs.span)


def mean_stress(pairs, area):
    """Eq (1) over all contacts: xx, yy, xy (3,) [Pa]."""
    return contact_moments(pairs).sum(axis=0) / area


def circle_stress(start, pairs, centres, radius):
    """Stress in circles: (q, 3) xx, yy, xy [Pa].

    start (m, 2): first points of the branches (centroids of the bodies a) [m]; centres (q, 2), radius [m].
    """
    return stress_along(start, pairs.span, contact_moments(pairs), centres, radius)


def stress_along(start, line, moments, centres, radius):
    """Stress in circles (q, 3) [Pa] from `moments` (m, 3) [N m], each distributed over its `line` (m, 2) from `start` (m, 2)."""
    stress = np.empty((len(centres), 3))
    reach = radius + np.hypot(*line.T).max(initial=0.0)
    for q, centre in enumerate(centres):
        near = np.flatnonzero(((start - centre) ** 2).sum(axis=1) < reach**2)
        share = share_inside(start[near] - centre, line[near], radius)
        stress[q] = share @ moments[near] / (np.pi * radius**2)
    return stress
