"""Outlines of stones: random, traced, placed.

A random outline in polar coordinates, with independent random numbers u, w in [0, 1):

    r_i = 1 + (2 u_i - 1) ROUGHNESS,   dtheta_i ~ 1 + (2 w_i - 1) JITTER         (1)

the angles scaled to one full turn. Source: Study on Failure Mechanism of Soil-Rock Slope with FDM-DEM Method
(2022), equations 13 to 17, where one random number serves both. The polygon is then brought to equal
principal moments and stretched, so that its flatness, the ratio of its principal radii of gyration, has
exactly the target value.
"""

import numpy as np
import shapely

from coupler_protocol.geometry import moments

ROUGHNESS = 0.3  # variation of a corner's distance from the centre; not given in the paper
JITTER = 0.3  # variation of the angle between two corners, the paper's delta
SIMPLER = 0.01  # largest displacement of an outline by simplification, as a share of its size


def random_outline(corners, flatness, rng):
    """A star-shaped polygon (corners, 2), convex or not, of area 1 about its centroid, long axis along x."""
    step = 1.0 + (2.0 * rng.random(corners) - 1.0) * JITTER
    angle = 2.0 * np.pi * (rng.random() + np.cumsum(step) / step.sum())
    radius = 1.0 + (2.0 * rng.random(corners) - 1.0) * ROUGHNESS
    xy = radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    _, centroid, second = moments(xy)
    value, axis = np.linalg.eigh(second)
    xy = (xy - centroid) @ (axis / np.sqrt(value)) @ axis.T  # equal principal moments, without rotation
    xy *= np.sqrt([flatness, 1.0 / flatness])
    return xy / np.sqrt(moments(xy).area)


def normalised(corners):
    """A traced outline (V, 2) of area 1 about its centroid, long axis along x, without unnecessary corners."""
    size = np.sqrt(4.0 * moments(corners).area / np.pi)
    simple = shapely.simplify(shapely.Polygon(corners), SIMPLER * size)
    xy = np.array(shapely.geometry.polygon.orient(simple).exterior.coords)[:-1]
    shape = moments(xy)
    c, s = np.cos(shape.azimuth), np.sin(shape.azimuth)
    return (xy - shape.centroid) @ np.array([[c, -s], [s, c]]) / np.sqrt(shape.area)


def placed(outline, centre, azimuth, size):
    """An outline of area 1 at `centre` (2,), turned by `azimuth` [rad], as large as a circle of diameter `size` [m]."""
    c, s = np.cos(azimuth), np.sin(azimuth)
    return centre + 0.5 * np.sqrt(np.pi) * size * (outline @ np.array([[c, s], [-s, c]]))
