"""Stones of a window: traced stones of a file, or random stones."""

import numpy as np
import shapely

from coupler_protocol.geometry import NOWHERE, moments, polygon_area, spot_on
from coupler_protocol.problems import unfit
from dem_server.stones import mesostructure
from dem_server.stones.mesostructure import Mesostructure
from dem_server.stones.traced_stones import LISTED, outlines_of

SLIVER = 1e-9  # of the window's area: smaller parts are round-off of clipping


def stones_of(domain, stones, rng, report=None, start=NOWHERE):
    """Mesostructure of a window (P, 2) by the [stones] table; start: as in `mapped`, the others as in `mesostructure.draw`."""
    return mesostructure.draw(domain, stones, rng, report) if stones.file is None else mapped(domain, stones, start)


def mapped(domain, stones, start=NOWHERE):
    """Traced stones inside the window (P, 2), the largest first; `stones.outside` applies to stones that reach beyond it.

    start (2,) [m]: point of the scene from which the window counts.
    """
    window, outlines = shapely.Polygon(domain), outlines_of(stones, "file", start)
    shapely.prepare(window)
    touching = [(o.name, shape) for o in outlines if window.intersects(shape := shapely.Polygon(o.corners))]
    crossing = [name for name, shape in touching if not window.covers(shape)]
    if crossing and stones.outside == "refuse":
        names = ", ".join(crossing[:LISTED]) + (" .." if len(crossing) > LISTED else "")
        what = f"{stones.file}: {len(crossing)} stones reach beyond the window: {names}"
        raise unfit("stones.outside", what, 'outside = "clip" or "leave out", or another window')
    if stones.outside == "leave out":
        touching = [(name, shape) for name, shape in touching if name not in crossing]
    pieces = [piece for _, shape in touching for piece in shapely.get_parts(shape.intersection(window))]
    found = [corners_of(piece) for piece in pieces if piece.area > SLIVER * window.area]
    if not found:
        x0, y0, x1, y1 = (spot_on(v, s) for v, s in zip(window.bounds, 2 * tuple(start), strict=True))
        what = f"{stones.file}: no stone of {len(outlines)} lies in the window, x {x0} to {x1}, y {y0} to {y1} m"
        raise unfit("stones.file", what, "check scale, origin and flip_y")
    found.sort(key=polygon_area, reverse=True)
    shapes = [moments(corners) for corners in found]
    size = np.sqrt(4.0 / np.pi * np.array([shape.area for shape in shapes]))
    azimuth = np.array([shape.azimuth for shape in shapes]) % np.pi
    return Mesostructure(found, size, np.array([shape.flatness for shape in shapes]), azimuth, 0)


def corners_of(polygon):
    """Corners (V, 2) of a polygon's exterior, counter-clockwise."""
    return np.array(shapely.geometry.polygon.orient(polygon).exterior.coords)[:-1]
