"""Means over a region of the discs: stress and porosity. A region is a circle (x, y, radius) or a polygon (P, 2) [m].

    stress   = -(1/A) sum w sym(F (x) l) + (1/A) sum virial of the walls             (1)
    porosity = 1 - (1/A) (sum area of disc and region - sum overlaps of two discs)    (2)

F: force on the second body of a contact, l: branch between the centroids of both bodies, w: share of l inside; walls count for
discs whose centre is inside. At rest the mean over everything between smooth walls is exactly their force over their length, also
with friction and rigid stones, because the forces at every centroid balance. Overlaps in (2), also within a stone, count if the
middle between both centres is inside; an area where three discs overlap is counted once too little. In (2), a stone is either its
discs, with gaps between them, or its polygon, which is its mass. A region without discs has no mean stress: NaN. Sources: Weber
(1966), Bull. Liaison Ponts et Chaussees 20; Christoffersen, Mehrabadi & Nemat-Nasser (1981), J. Appl. Mech. 48, 339-344.
"""

from typing import TYPE_CHECKING, Any

import numpy as np
import scipy
import shapely

from coupler_protocol.geometry import disc_in_polygon
from coupler_protocol.measures.regions import Region, solid_area

if TYPE_CHECKING:
    from colluvium.results.rank_file import Fields

ROUNDING = 1e-12  # of the squared radius: a smaller area of a disc is none
POINTS = 64  # of the grid of `share_reached`, along x and along y
CIRCLE_SIDES = 1024  # of a quarter of a circle that cuts stones


def average_stress(discs: "Fields", contacts: "Fields", region: Any) -> np.ndarray:
    """Mean stress xx, yy, xy (3,) [Pa] in a region, Eq (1), tension positive; NaN where no disc reaches into it."""
    if discs_inside(discs, region) == 0:
        return np.full(3, np.nan)
    place = Region(region)
    body = discs.centroid if "centroid" in discs else discs.xy
    start, span = body[contacts.ends[:, 0]], np.diff(body[contacts.ends], axis=1)[:, 0]
    force = contact_forces(discs, contacts)
    (fx, fy), (lx, ly) = (force * place.shares(start, span)[:, None]).T, span.T
    total = -np.array([fx @ lx, fy @ ly, 0.5 * (fx @ ly + fy @ lx)])
    if "wall_virial" in discs:
        total += discs.wall_virial[place.contains(discs.xy)][:, [0, 1, 3]].sum(axis=0)
    return total / place.area


def discs_inside(discs: "Fields", region: Any) -> int:
    """Number of discs that share area with a region."""
    return int(np.count_nonzero(Region(region).areas(discs.xy, discs.radius) > ROUNDING * discs.radius**2))


def share_reached(discs: "Fields", region: Any) -> float:
    """Share of a region's area that lies in discs, or not farther than a mean radius from one; by a grid of points."""
    place = Region(region)
    low, high = place.bounds
    lines = [a + (b - a) * (np.arange(POINTS) + 0.5) / POINTS for a, b in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*lines), axis=-1).reshape(-1, 2)
    points = points[place.contains(points)]
    reach, reached = discs.radius + discs.radius.mean(), np.zeros(len(points), dtype=np.bool_)
    near = (np.abs(discs.xy - np.clip(discs.xy, low, high)) < reach[:, None]).all(axis=1)
    tree = scipy.spatial.cKDTree(points)
    for found in tree.query_ball_point(discs.xy[near], reach[near]):
        reached[found] = True
    return float(reached.mean())


def porosity(discs: "Fields", region: Any, stones: list[np.ndarray] | None = None) -> float:
    """Porosity of a region [-], Eq (2), exact for circles and polygons of any shape except for overlaps on its edge.

    stones: polygons (V, 2) of the stones [m]; if given, each stone with discs is its polygon in place of its discs.
    """
    place = Region(region)
    areas, xy, radius, polygons = place.areas(discs.xy, discs.radius), discs.xy, discs.radius, 0.0
    if stones:
        held = np.unique(discs.stone[discs.stone >= 0])
        soil = discs.stone < 0
        areas, xy, radius = areas[soil], xy[soil], radius[soil]
        circle = place.circle
        whole = place.shape if circle is None else shapely.Point(circle[:2]).buffer(circle[2], quad_segs=CIRCLE_SIDES)
        polygons = sum(_stone_inside(shapely.Polygon(stones[k]).intersection(whole), xy, radius) for k in held)
    return 1.0 - (solid_area(xy, radius, areas, place) + polygons) / place.area


def _stone_inside(shape: Any, xy: np.ndarray, radius: np.ndarray) -> float:
    """Area [m2] of a stone's part inside a region, minus the area that it shares with discs of the soil."""
    total = 0.0
    for part in getattr(shape, "geoms", [shape]):
        if part.area > 0.0:
            near = shapely.distance(part, shapely.points(xy)) < radius
            ring = shapely.get_coordinates(shapely.geometry.polygon.orient(part))
            total += part.area - float(disc_in_polygon(xy[near], radius[near], ring).sum())
    return total


def contact_forces(discs: "Fields", contacts: "Fields") -> np.ndarray:
    """Forces (C, 2) on the second disc of every contact [N]."""
    branch = np.diff(discs.xy[contacts.ends], axis=1)[:, 0]
    normal = branch / np.hypot(*branch.T)[:, None]
    force = contacts.normal_force[:, None] * normal
    if "shear_force" in contacts:
        force += contacts.shear_force[:, None] * np.column_stack([-normal[:, 1], normal[:, 0]])
    return force
