"""Means over a region of the discs: stress and porosity. A region is a circle (x, y, radius) or a polygon (P, 2) [m].

    stress   = -(1/A) sum w sym(F (x) l) + (1/A) sum virial of the walls             (1)
    porosity = 1 - (1/A) (sum area of disc and region - sum overlaps of two discs)    (2)

F: force on the second body of a contact, l: branch between the centroids of both bodies, w: share of l inside; walls count for
discs whose centre is inside. At rest the mean over everything between smooth walls is exactly their force over their length, also
with friction and rigid stones, because the forces at every centroid balance. Overlaps in (2), also within a stone, count if the
middle between both centres is inside; an area where three discs overlap is counted once too little. Sources: Weber (1966), Bull.
Liaison Ponts et Chaussees 20; Christoffersen, Mehrabadi & Nemat-Nasser (1981), J. Appl. Mech. 48, 339-344.
"""

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from scipy.spatial import cKDTree

from coupler_protocol.geometry import share_inside

if TYPE_CHECKING:
    from colluvium.results.rank_file import Fields


def average_stress(discs: "Fields", contacts: "Fields", region: Any) -> np.ndarray:
    """Mean stress xx, yy, xy (3,) [Pa] in a region, Eq (1), tension positive."""
    circle, shape = _region(region)
    body = discs.centroid if "centroid" in discs else discs.xy
    start, span = body[contacts.ends[:, 0]], np.diff(body[contacts.ends], axis=1)[:, 0]
    force = contact_forces(discs, contacts)
    if circle is not None:
        inside = share_inside(start - circle[:2], span, circle[2])
    else:
        lines = shapely.linestrings(np.stack([start, start + span], axis=1))
        inside = np.asarray(shapely.length(shapely.intersection(lines, shape)) / shapely.length(lines))
    (fx, fy), (lx, ly) = (force * inside[:, None]).T, span.T
    total = -np.array([fx @ lx, fy @ ly, 0.5 * (fx @ ly + fy @ lx)])
    if "wall_virial" in discs:
        total += discs.wall_virial[_points_inside(discs.xy, circle, shape)][:, [0, 1, 3]].sum(axis=0)
    return total / _area(circle, shape)


def porosity(discs: "Fields", region: Any) -> float:
    """Porosity of a region [-], Eq (2), exact for circles and polygons of any shape except for overlaps on its edge."""
    circle, shape = _region(region)
    if circle is not None:
        solid = disc_in_circle(discs.xy - circle[:2], discs.radius, circle[2])
    else:
        solid = disc_in_polygon(discs.xy, discs.radius, shapely.get_coordinates(shape))
    near = cKDTree(discs.xy).query_pairs(2.0 * float(discs.radius.max()), output_type="ndarray")
    a, b = discs.xy[near].swapaxes(0, 1)
    distance, radius = np.hypot(*(b - a).T), discs.radius[near]
    over = distance < radius.sum(axis=1)
    a, b, overlap = a[over], b[over], lens(distance[over], *radius[over].T)
    twice = overlap[_points_inside(0.5 * (a + b), circle, shape)]
    return 1.0 - float(solid.sum() - twice.sum()) / _area(circle, shape)


def contact_forces(discs: "Fields", contacts: "Fields") -> np.ndarray:
    """Forces (C, 2) on the second disc of every contact [N]."""
    branch = np.diff(discs.xy[contacts.ends], axis=1)[:, 0]
    normal = branch / np.hypot(*branch.T)[:, None]
    force = contacts.normal_force[:, None] * normal
    if "shear_force" in contacts:
        force += contacts.shear_force[:, None] * np.column_stack([-normal[:, 1], normal[:, 0]])
    return force


def disc_in_circle(xy: np.ndarray, radius: np.ndarray, circle: float) -> np.ndarray:
    """Area (n,) [m2] that discs share with the circle of radius `circle` [m] around the origin."""
    return lens(np.hypot(*xy.T), radius, np.full(len(xy), circle))


def lens(d: np.ndarray, r: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Area (n,) [m2] that circles of radii r and s share at the distance d [m] of their centres."""
    area = np.where(d < r + s, np.pi * np.minimum(r, s) ** 2, 0.0)
    cut = (d < r + s) & (d > np.abs(r - s))
    d, r, s = d[cut], r[cut], s[cut]
    a = (d * d + r * r - s * s) / (2.0 * d)  # from the centre of r to the chord
    half = np.sqrt(np.maximum(r * r - a * a, 0.0))
    area[cut] = r * r * np.arctan2(half, a) + s * s * np.arctan2(half, d - a) - d * half
    return area


def disc_in_polygon(xy: np.ndarray, radius: np.ndarray, ring: np.ndarray) -> np.ndarray:
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


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def _angle(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.arctan2(_cross(a, b), (a * b).sum(axis=1))


def _region(region: Any) -> tuple[np.ndarray | None, shapely.Polygon | None]:
    """Circle (3,) or None, and polygon, counter-clockwise, or None; raises ValueError for other regions."""
    values = np.asarray(region, dtype=float)
    if values.shape == (3,) and values[2] > 0.0:
        return values, None
    if values.ndim == 2 and values.shape[1] == 2 and len(values) > 2:
        shape = shapely.geometry.polygon.orient(shapely.Polygon(values))
        if shape.is_valid and shape.area > 0.0:
            return None, shape
    raise ValueError(f"a region is (x, y, radius) or the corners of a polygon that does not cross itself, not {region!r}")


def _area(circle: np.ndarray | None, shape: Any) -> float:
    return float(np.pi * circle[2] ** 2) if circle is not None else shape.area


def _points_inside(xy: np.ndarray, circle: np.ndarray | None, shape: Any) -> np.ndarray:
    if circle is not None:
        return np.hypot(*(xy - circle[:2]).T) < circle[2]
    return shapely.contains_xy(shape, xy[:, 0], xy[:, 1])
