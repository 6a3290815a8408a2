"""Stress in circles if some of the discs form rigid stones.

The stress inside a rigid stone is not determined by the forces on its edge, but its mean is:

    |P| sigma_P = -sum_c sym(F_c (x) (x_c - X))                                  (1)

P: polygon of the stone, X: its centroid, x_c: points of contact, F_c: force on the other body. So every branch is divided
at its point of contact. Parts in soil count as lines; parts in a stone count only through (1), uniform over its polygon:

    sigma = (1/A) (sum_soil w_c m_c + sum_P |P in the circle| sigma_P)           (2)

with moments m_c and shares w_c as in contact_stress.py. A straight branch from centroid to centroid has the same sum, but
places the stress along the branch, outside the stone or on one line through it. In circles as small as the stones this gives
no valid average.
"""

import numpy as np
import shapely

from coupler_protocol.geometry import polygon_area
from dem_server.insitu.contact_stress import stress_along
from dem_server.pairs import body_centres, contacts, moments_along

ARC = 64  # edges of a quarter of a circle: its area has an error of 1e-4


def circle_stress_with_stones(state, outlines, centres, radius):
    """Stress (q, 3) xx, yy, xy [Pa] of Eq (2) in circles `centres` (q, 2), `radius` [m]; outlines: present polygons of clumps."""
    start, line, moments, stone = _parted_branches(state)
    soil = stone < 0
    stress = stress_along(start[soil], line[soil], moments[soil], centres, radius)
    shapes = np.array([shapely.Polygon(outline) for outline in outlines])
    mean = _means(moments[~soil], stone[~soil], shapely.area(shapes))
    for q, circle in enumerate(shapely.buffer(shapely.points(centres), radius, quad_segs=ARC)):
        stress[q] += shapely.area(shapely.intersection(shapes, circle)) @ mean / (np.pi * radius**2)
    return stress


def stone_stress(state, outlines):
    """Mean stress (S, 3) xx, yy, xy [Pa] of the stones, Eq (1); 0 for a stone without discs."""
    _, _, moments, stone = _parted_branches(state)
    inside = stone >= 0
    return _means(moments[inside], stone[inside], np.array([polygon_area(outline) for outline in outlines]))


def _parted_branches(state):
    """Start, line (2 m, 2) [m], moment (2 m, 3) [N m] of the parts of all branches, and the clump of each part, -1: soil."""
    pairs, centre = contacts(state), body_centres(state)
    arm = 0.5 * (np.hypot(*pairs.branch.T) + state.radius[pairs.disc_a] - state.radius[pairs.disc_b])
    touch = state.x[pairs.disc_a] + arm[:, None] * pairs.normal
    a, b = centre[pairs.disc_a], centre[pairs.disc_b]
    start, line = np.concatenate([a, touch]), np.concatenate([touch - a, b - touch])
    stone = state.clumps.body[np.concatenate([pairs.disc_a, pairs.disc_b])]
    return start, line, moments_along(np.concatenate([pairs.force, pairs.force]), line), stone


def _means(moments, stone, area):
    return np.column_stack([np.bincount(stone, column, minlength=len(area)) for column in moments.T]) / area[:, None]
