"""Plane geometry that servers and reports share: loops of points, moments of polygons, lines in circles, corners of zones.

Green's theorem turns integrals over a simple counter-clockwise polygon into sums over its edges, with
c = x_i y_(i+1) - x_(i+1) y_i:

    A = sum c / 2,   A X = sum c (p_i + p_(i+1)) / 6                             (1)
    int p p^T = sum c (p_i p_i^T + p_(i+1) p_(i+1)^T + sym(p_i p_(i+1)^T)) / 12  (2)
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Whole = NDArray[np.int64]

CORNERS = np.arange(4)  # of a zone
NOWHERE = (0.0, 0.0)
FAR = 1e5  # times the size of a loop: its area has lost half of its digits there


def spot(point: Array | Sequence[float], origin: tuple[float, float] = NOWHERE, digits: int = 4) -> str:
    """Text "(x, y)" of a point [m] counted from `origin`, in the coordinates of the scene."""
    return f"({', '.join(spot_on(value, start, digits) for value, start in zip(point, origin, strict=True))})"


def spot_on(value: float, start: float = 0.0, digits: int = 6) -> str:
    """Text of a coordinate [m] counted from `start`, in those of the scene; digits: of the number counted from `start`."""
    return f"{value:.{digits}g}" if start == 0.0 else f"{float(f'{value:.{digits}g}') + start:.12g}"


def segment_vectors(nodes: Array) -> Array:
    """Vectors (K,2) from each node to the next along the closed loop [m]."""
    return np.roll(nodes, -1, axis=0) - nodes


def polygon_area(nodes: Array) -> float:
    """Signed area [m2] of the loop, positive when it runs counter-clockwise; nodes FAR away are counted from the first one."""
    if np.abs(nodes).max() > FAR * np.ptp(nodes, axis=0).max():
        nodes = nodes - nodes[0]  # the products below cancel
    following = np.roll(nodes, -1, axis=0)
    return 0.5 * float(np.sum(nodes[:, 0] * following[:, 1] - nodes[:, 1] * following[:, 0]))


class Moments(NamedTuple):
    """area [m2], centroid (2,) [m], second moments (2, 2) about the centroid: int p p^T [m4]."""

    area: float
    centroid: Array
    second: Array

    @property
    def gyration(self) -> float:
        """Squared polar radius of gyration [m2]: inertia over mass."""
        return float(np.trace(self.second)) / self.area

    @property
    def flatness(self) -> float:
        """Ratio of the principal radii of gyration [-]."""
        least, largest = np.linalg.eigvalsh(self.second)
        return float(np.sqrt(largest / least))

    @property
    def azimuth(self) -> float:
        """Direction of the long axis [rad], in (-pi/2, pi/2]."""
        (xx, xy), (_, yy) = self.second
        return 0.5 * float(np.arctan2(2.0 * xy, xx - yy))


def moments(corners: Array) -> Moments:
    """Moments of a simple counter-clockwise polygon (P, 2), Eqs (1) and (2)."""
    p = corners - corners.mean(axis=0)  # avoids cancellation far from the origin
    q = np.roll(p, -1, axis=0)
    c = p[:, 0] * q[:, 1] - q[:, 0] * p[:, 1]
    area = 0.5 * float(c.sum())
    centre = c @ (p + q) / (6.0 * area)
    half = (p * c[:, None]).T @ q
    origin = ((p * c[:, None]).T @ p + (q * c[:, None]).T @ q + 0.5 * (half + half.T)) / 12.0
    return Moments(area, corners.mean(axis=0) + centre, origin - area * np.outer(centre, centre))


def outline_fault(corners: Array | list[tuple[float, float]]) -> str | None:
    """What keeps corners (P, 2) from enclosing an area, as a predicate with the place; None for a simple polygon."""
    import shapely  # imported only where there is a polygon: it loads slowly

    if len(corners) < 3:
        return f"has {len(corners)} corners"
    shape = shapely.Polygon(corners)
    if not shape.convex_hull.area > 0.0:
        return "has no area"
    if shape.is_valid:
        return None
    where = shapely.is_valid_reason(shape).partition("[")[2].rstrip("]")
    return f"crosses or touches itself at ({where.replace(' ', ', ')})"


def share_inside(start: Array, branch: Array, radius: float) -> Array:
    """Share (m,) of each line from `start` along `branch` (m, 2) [m] inside the circle of this radius [m] around the origin."""
    a = (branch**2).sum(axis=1)
    b = (start * branch).sum(axis=1)
    c = (start**2).sum(axis=1) - radius**2
    half = np.sqrt(np.maximum(b * b - a * c, 0.0))
    enter, leave = np.clip((-b - half) / a, 0.0, 1.0), np.clip((-b + half) / a, 0.0, 1.0)
    return leave - enter


def share_in_polygon(start: Array, branch: Array, corners: Array) -> Array:
    """Share (m,) of each line from `start` along `branch` (m, 2) [m] inside a simple polygon (P, 2), convex or not.

    The whole straight line enters and leaves the polygon in turn; of each way inside, the part within the branch counts.
    """
    crossings = np.full((len(start), len(corners) + len(corners) % 2), np.inf)
    for k, (a, b) in enumerate(zip(corners, np.roll(corners, -1, axis=0), strict=True)):
        first, second = _cross(branch, a - start), _cross(branch, b - start)
        cuts = (first < 0.0) != (second < 0.0)
        edge = np.broadcast_to(b - a, start.shape)[cuts]
        crossings[cuts, k] = _cross((a - start)[cuts], edge) / _cross(branch[cuts], edge)
    crossings.sort(axis=1)
    ends = np.clip(crossings, 0.0, 1.0)
    share: Array = (ends[:, 1::2] - ends[:, ::2]).sum(axis=1)
    return share


def disc_in_polygon(xy: Array, radius: Array, ring: Array) -> Array:
    """Area (n,) [m2] that discs share with a polygon, ring (P + 1, 2) closed and counter-clockwise.

    Sum over the edges of the area between edge and centre: a triangle for the part inside the disc, sectors elsewhere.
    """
    area = np.zeros(len(xy))
    for a, b in pairwise(ring):
        p, q = a - xy, b - xy
        step = b - a
        half, middle = step @ step, p @ step
        root = np.sqrt(np.maximum(middle**2 - half * ((p * p).sum(axis=1) - radius**2), 0.0))
        enter, leave = (p + np.clip((-middle + sign * root) / half, 0.0, 1.0)[:, None] * step for sign in (-1.0, 1.0))
        area += 0.5 * radius**2 * (_angle(p, enter) + _angle(leave, q)) + 0.5 * _cross(enter, leave)
    return area


def corner_weights(corners: Whole) -> Array:
    """Shares (Z, 4) of the corners in their zone: 1/4, in a triangle 1/3."""
    weight = np.full(corners.shape, 1.0 / 4.0)
    weight[corners[:, 2] == corners[:, 3]] = 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0
    return weight


def corner_joints(corners: Whole, material: Whole) -> Whole:
    """Numbers (Z, 4), from 0, of the groups of corners of zones that values at gridpoints are averaged over.

    corners (Z, 4): gridpoints of each zone, the last one twice in a triangle; material (Z,). A group has the corners at one
    gridpoint of zones of one material that can be reached around the gridpoint through sides. So nothing is averaged over the
    boundary of two materials, over removed zones, or between zones that touch in one point only.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    following = (CORNERS + 1) % 4
    place = 4 * np.arange(len(corners))[:, None]
    first, second = corners.ravel(), corners[:, following].ravel()  # the two ends of each side
    of_first, of_second = (place + CORNERS).ravel(), (place + following).ravel()
    low, high = np.minimum(first, second), np.maximum(first, second)
    of_low, of_high = np.where(first < second, of_first, of_second), np.where(first < second, of_second, of_first)
    order = np.lexsort((np.repeat(material, 4), high, low))
    order = order[low[order] < high[order]]
    sides = np.column_stack([low, high, np.repeat(material, 4)])[order]
    shared = (sides[1:] == sides[:-1]).all(axis=1)
    one, other = order[:-1][shared], order[1:][shared]
    twice = low == high  # the repeated corner of a triangle
    a = np.concatenate([of_low[one], of_high[one], of_first[twice]])
    b = np.concatenate([of_low[other], of_high[other], of_second[twice]])
    graph = coo_matrix((np.ones(len(a), dtype=np.bool_), (a, b)), shape=(corners.size, corners.size))
    joints: Whole = connected_components(graph, directed=False)[1].reshape(corners.shape)
    return joints


def _cross(a: Array, b: Array) -> Array:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def _angle(a: Array, b: Array) -> Array:
    return np.arctan2(_cross(a, b), (a * b).sum(axis=1))
