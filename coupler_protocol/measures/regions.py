"""Circles and polygons in which discs are measured: exact areas of discs, exact parts of lines, points inside.

A region is (x, y, radius) or the corners (P, 2) [m] of a polygon that does not cross itself, convex or not.
"""

from functools import cached_property
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from coupler_protocol.geometry import disc_in_polygon, share_in_polygon, share_inside

Array = NDArray[np.float64]


class Region:
    """A circle (x, y, radius) or a polygon (P, 2) [m]; raises ValueError for anything else.

    circle (3,) or None; shape: polygon of shapely, counter-clockwise, or None.
    """

    def __init__(self, region: Any) -> None:
        values = np.asarray(region, dtype=float)
        self.circle: Array | None = None
        self.shape: Any = None
        if values.shape == (3,) and values[2] > 0.0:
            self.circle = values
            return
        if values.ndim == 2 and values.shape[1] == 2 and len(values) > 2:
            self.shape = shapely.geometry.polygon.orient(shapely.Polygon(values))
        if self.shape is None or not self.shape.is_valid or not self.shape.area > 0.0:
            raise ValueError(f"a region is (x, y, radius) or the corners of a polygon that does not cross itself, not {region!r}")

    @cached_property
    def ring(self) -> Array:
        """Corners (P + 1, 2) of the polygon, closed."""
        return np.asarray(shapely.get_coordinates(self.shape))

    @cached_property
    def area(self) -> float:
        """Area [m2]."""
        return float(np.pi * self.circle[2] ** 2) if self.circle is not None else float(self.shape.area)

    @cached_property
    def perimeter(self) -> float:
        """Length of the edge [m]."""
        return float(2.0 * np.pi * self.circle[2]) if self.circle is not None else float(self.shape.length)

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Lower left and upper right corner (2,) [m]."""
        if self.circle is not None:
            return self.circle[:2] - self.circle[2], self.circle[:2] + self.circle[2]
        low, high = np.reshape(self.shape.bounds, (2, 2))
        return low, high

    def contains(self, xy: Array) -> NDArray[np.bool_]:
        """Whether each of the points (n, 2) is inside (n,)."""
        if self.circle is not None:
            return np.asarray(np.hypot(*(xy - self.circle[:2]).T) < self.circle[2])
        return np.asarray(shapely.contains_xy(self.shape, xy[:, 0], xy[:, 1]))

    def areas(self, xy: Array, radius: Array) -> Array:
        """Area (n,) [m2] that each disc shares with the region, exact."""
        if self.circle is not None:
            return disc_in_circle(xy - self.circle[:2], radius, float(self.circle[2]))
        return disc_in_polygon(xy, radius, self.ring)

    def shares(self, start: Array, branch: Array) -> Array:
        """Share (m,) of each line from `start` along `branch` (m, 2) [m] inside, exact."""
        if self.circle is not None:
            return share_inside(start - self.circle[:2], branch, float(self.circle[2]))
        return share_in_polygon(start, branch, self.ring[:-1])


def disc_in_circle(xy: Array, radius: Array, circle: float) -> Array:
    """Area (n,) [m2] that discs share with the circle of radius `circle` [m] around the origin."""
    return lens(np.hypot(*xy.T), radius, np.full(len(xy), circle))


def lens(d: Array, r: Array, s: Array) -> Array:
    """Area (n,) [m2] that circles of radii r and s share at the distance d [m] of their centres."""
    area = np.where(d < r + s, np.pi * np.minimum(r, s) ** 2, 0.0)
    cut = (d < r + s) & (d > np.abs(r - s))
    d, r, s = d[cut], r[cut], s[cut]
    a = (d * d + r * r - s * s) / (2.0 * d)  # from the centre of r to the chord
    half = np.sqrt(np.maximum(r * r - a * a, 0.0))
    area[cut] = r * r * np.arctan2(half, a) + s * s * np.arctan2(half, d - a) - d * half
    return area


def solid_area(xy: Array, radius: Array, areas: Array, region: Region) -> float:
    """Area [m2] of the union of discs inside a region.

    areas (n,): of the discs inside. Overlaps of two discs count if the middle between both centres is inside; an area where three
    discs overlap is counted once too little.
    """
    from scipy.spatial import cKDTree

    near = cKDTree(xy).query_pairs(2.0 * float(radius.max(initial=0.0)), output_type="ndarray")
    a, b = xy[near].swapaxes(0, 1)
    distance, radii = np.hypot(*(b - a).T), radius[near]
    over = distance < radii.sum(axis=1)
    a, b, overlap = a[over], b[over], lens(distance[over], *radii[over].T)
    twice = overlap[region.contains(0.5 * (a + b))]
    return float(areas.sum() - twice.sum())
