"""Polygons: area, centroid, second moments, and the random outline of a stone.

Green's theorem turns integrals over a simple counter-clockwise polygon into sums over its edges, with
c = x_i y_(i+1) - x_(i+1) y_i:

    A = sum c / 2,   A X = sum c (p_i + p_(i+1)) / 6                             (1)
    int p p^T = sum c (p_i p_i^T + p_(i+1) p_(i+1)^T + sym(p_i p_(i+1)^T)) / 12  (2)

Outline of a stone in polar coordinates, with independent random numbers u, w in [0, 1):

    r_i = 1 + (2 u_i - 1) ROUGHNESS,   dtheta_i ~ 1 + (2 w_i - 1) JITTER         (3)

the angles scaled to one full turn. Source: Study on Failure Mechanism of Soil-Rock Slope with FDM-DEM Method
(2022), equations 13 to 17, where one random number serves both. The polygon is then brought to equal
principal moments and stretched, so that its flatness, the ratio of its principal radii of gyration, is
exactly the one asked for.
"""

from typing import NamedTuple

import numpy as np
import shapely

ROUGHNESS = 0.3  # variation of a corner's distance from the centre; not given in the paper
JITTER = 0.3  # variation of the angle between two corners, the paper's delta
SIMPLER = 0.01  # of its size an outline may move where a shape is simplified


class Moments(NamedTuple):
    """area [m2], centroid (2,) [m], second moments (2, 2) about the centroid: int p p^T [m4]."""

    area: float
    centroid: np.ndarray
    second: np.ndarray

    @property
    def gyration(self):
        """Squared polar radius of gyration [m2]: inertia over mass."""
        return float(np.trace(self.second)) / self.area

    @property
    def flatness(self):
        """Ratio of the principal radii of gyration [-]."""
        least, largest = np.linalg.eigvalsh(self.second)
        return float(np.sqrt(largest / least))

    @property
    def azimuth(self):
        """Direction of the long axis [rad], in (-pi/2, pi/2]."""
        (xx, xy), (_, yy) = self.second
        return 0.5 * float(np.arctan2(2.0 * xy, xx - yy))


def moments(corners):
    """Moments of a simple counter-clockwise polygon (P, 2), Eqs (1) and (2)."""
    p = corners - corners.mean(axis=0)  # near the origin nothing cancels
    q = np.roll(p, -1, axis=0)
    c = p[:, 0] * q[:, 1] - q[:, 0] * p[:, 1]
    area = 0.5 * float(c.sum())
    centre = c @ (p + q) / (6.0 * area)
    half = (p * c[:, None]).T @ q
    origin = ((p * c[:, None]).T @ p + (q * c[:, None]).T @ q + 0.5 * (half + half.T)) / 12.0
    return Moments(area, corners.mean(axis=0) + centre, origin - area * np.outer(centre, centre))


def random_outline(corners, flatness, rng):
    """A star-shaped polygon (corners, 2), convex or not, of area 1 about its centroid, long axis along x."""
    step = 1.0 + (2.0 * rng.random(corners) - 1.0) * JITTER
    angle = 2.0 * np.pi * (rng.random() + np.cumsum(step) / step.sum())
    radius = 1.0 + (2.0 * rng.random(corners) - 1.0) * ROUGHNESS
    xy = radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    _, centroid, second = moments(xy)
    value, axis = np.linalg.eigh(second)
    xy = (xy - centroid) @ (axis / np.sqrt(value)) @ axis.T  # equal principal moments, nothing turned
    xy *= np.sqrt([flatness, 1.0 / flatness])
    return xy / np.sqrt(moments(xy).area)


def normalised(corners):
    """A traced outline (V, 2) of area 1 about its centroid, long axis along x, without corners that tell no shape."""
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
