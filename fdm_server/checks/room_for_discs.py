"""Room for discs in a window of any shape: it is wide enough somewhere, and no part is too narrow.

With R the mean radius of the discs, a circle of radius 8 R must fit somewhere: the window is eight discs wide there. A circle of
radius 4 R, four discs wide, must be able to roll through the whole window, and no point may be farther than 8 R from it. (The
corner of a 45 degree wedge has the distance 6.5 R, that of a rectangle 1.7 R.)
"""

import numpy as np
import shapely

from coupler_protocol.geometry import NOWHERE, spot

WIDE = 8.0  # radius of the circle that fits somewhere, in R
NARROW = 4.0  # radius of the circle that reaches everywhere, in R
CORNER = 8.0  # largest distance of corners from this circle, in R
STRAIGHT = 1e-3  # smallest sine of a turn at a corner
LISTED = 24  # corners in a message
EXACT = 1.0 - 1e-9  # windows may be exactly as wide


def lack_of_room(outline, radius, origin=NOWHERE):
    """Problem of a window of outline (K,2) [m], from `origin`, for discs of mean `radius` [m], and its remedy; or None."""
    window = shapely.Polygon(outline)
    x0, y0, x1, y1 = window.bounds
    if window.buffer(-WIDE * EXACT * radius).is_empty:
        most = _largest_circle(window) / WIDE
        what = f"is {x1 - x0:.4g} x {y1 - y0:.4g} m: too small for discs of radius {radius:g} m"
        return what, f"radius at most {most:.3g} m, or a larger window"
    reached = shapely.buffer(window, -NARROW * EXACT * radius)
    parts = shapely.get_parts(reached)
    if len(parts) > 1:
        x, y = shapely.shortest_line(parts[0], shapely.union_all(parts[1:])).centroid.coords[0]
        return _narrow((x, y), radius, outline, origin)
    corners = np.asarray(outline)
    far = shapely.distance(reached, shapely.points(corners)) - NARROW * radius
    if far.max() > CORNER * radius:
        return _narrow(corners[far.argmax()], radius, outline, origin)
    return None


def _narrow(at, radius, outline, origin):
    what = f"is narrower than {NARROW:g} discs of radius {radius:g} m at {spot(at, origin)}; its zones have the outline "
    return what + corners_as_text(outline, origin), "smaller discs, or a polygon along the zones, without tips"


def corners_as_text(outline, origin=NOWHERE):
    """Corners of an outline (K,2) at which it turns, at most LISTED of them."""
    step = np.roll(outline, -1, axis=0) - outline
    before = np.roll(step, 1, axis=0)
    turns = np.abs(before[:, 0] * step[:, 1] - before[:, 1] * step[:, 0]) > STRAIGHT * np.hypot(*step.T) * np.hypot(*before.T)
    corners = np.asarray(outline)[turns]
    shown = " ".join(spot(corner, origin) for corner in corners[:LISTED])
    return shown + (f" .. ({len(corners)} corners)" if len(corners) > LISTED else "")


def _largest_circle(window):
    """Radius [m] of the largest circle inside."""
    return shapely.maximum_inscribed_circle(window, tolerance=1e-4 * np.sqrt(window.area)).length
