"""Rules for [[measure]] tables that need only the scene: one function each, as in between_tables.py.

Whether a region lies inside of the ring of its window is known once the ring is: dem_server/observe/measuring.py.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from coupler_protocol.geometry import outline_fault, spot
from coupler_protocol.problems import Finding
from coupler_protocol.scene.of_window import of_window

WIDTH = 4.0  # mean diameters of the discs: least width of a region


def regions_measure_discs(scene: Any) -> Iterator[Finding]:
    """A region names a window that exists, lies inside of its outline as far as the scene gives it, and holds some discs."""
    names = [window.name for window in scene.window]
    for i, measure in enumerate(scene.measure):
        at = ("measure", i)
        if scene.discs is None:
            yield at, "the scene has no discs to measure", "remove the table, or add [[window]] and [discs]"
            continue
        if measure.window is not None and measure.window not in names:
            yield (*at, "window"), f"no window is named {measure.window!r}", f"windows: {', '.join(names) or 'none'}"
            continue
        if measure.window is None and len(names) > 1:
            yield at, f"the scene has {len(names)} windows", f"window = one of {', '.join(names)}"
            continue
        number = 0 if measure.window is None else names.index(measure.window)
        yield from _too_small(of_window(scene, number + 1) if names else scene, measure, at)
        if names:
            yield from _outside(scene, measure, scene.window[number], at)


def _too_small(scene: Any, measure: Any, at: tuple) -> Iterator[Finding]:
    """A region that is narrower than WIDTH discs has no mean; `scene`: that of its window."""
    least = 2.0 * WIDTH * scene.discs.radius
    if measure.radius is not None and 2.0 * measure.radius < least:
        why = f"a circle of {2.0 * measure.radius:g} m across is smaller than {WIDTH:g} discs"
        yield (*at, "radius"), why, f"radius at least {0.5 * least:g} m"


def _outside(scene: Any, measure: Any, window: Any, at: tuple) -> Iterator[Finding]:
    """A region that reaches out of the window."""
    import shapely  # imported only where there is a region: it loads slowly

    corners = _outline(scene, window)
    if corners is None or outline_fault(corners) or (measure.polygon is not None and outline_fault(measure.polygon)):
        return
    shape, edge = shapely.Polygon(corners), shapely.Polygon(corners).exterior
    if measure.polygon is not None:
        inside = shape.buffer(1e-9 * shape.length).covers(shapely.Polygon(measure.polygon))
    else:
        point = shapely.Point(measure.centre)
        inside = shape.covers(point) and edge.distance(point) >= measure.radius * (1.0 - 1e-9)
    if not inside:
        key = "polygon" if measure.polygon is not None else "radius"
        why = f"region {measure.name!r} reaches out of window {window.name!r}"
        low, high = np.reshape(shape.bounds, (2, 2))
        yield (*at, key), why, f"stay inside of its outline, between {spot(low, scene.origin)} and {spot(high, scene.origin)} m"


def _outline(scene: Any, window: Any) -> Any:
    """Corners (P, 2) [m] of the window; None where only the grid knows them."""
    if scene.grid is None:
        return window.polygon
    if window.polygon is not None or window.columns is None or window.rows is None or not scene.grid.regular:
        return None
    (dx, dy), (c0, c1), (r0, r1) = scene.grid.zone_size, window.columns, window.rows
    x0, x1, y0, y1 = c0 * dx, (c1 + 1) * dx, r0 * dy, (r1 + 1) * dy  # the local scene counts from the corner of the grid
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]


MEASURE_RULES = (regions_measure_discs,)
