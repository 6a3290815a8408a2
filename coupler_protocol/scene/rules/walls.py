"""Doubts about walls that almost meet: a disc at the gap touches both, with twice the stiffness and damping of one wall."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from coupler_protocol.problems import Finding
from coupler_protocol.scene.tables.discs import names_of_walls
from coupler_protocol.scene.tables.grading import grading_of

SAME = 1e-6  # of the radius: walls nearer than this to each other meet (dem_server/step/wall_surface.py)
NEAR = 0.05  # of the smallest radius: a disc passes over a narrower gap without falling into it
AROUND = 3.0  # widths of a gap: other walls within this may close it
MANY = 2000  # walls, of which pairs are not looked at


def walls_that_almost_meet(scene: Any) -> Iterator[Finding]:
    """Two walls at rest to each other with a gap or a step that no disc notices but by a second contact."""
    walls = scene.discs.wall if scene.discs is not None else []
    if len(walls) < 2 or len(walls) > MANY:
        return
    import shapely  # loads slowly

    ends = np.array([wall.ends for wall in walls])
    ends = ends - ends.reshape(-1, 2).min(axis=0)
    lines, names, radius = shapely.linestrings(ends), names_of_walls(walls), grading_of(scene.discs).smallest
    near = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=NEAR * radius)
    for i, k in sorted((i, k) for i, k in near.T.tolist() if i < k):
        between = shapely.shortest_line(lines[i], lines[k])
        width = float(between.length)
        if width <= SAME * radius or _motion(walls[i]) != _motion(walls[k]) or _closed(lines, between, (i, k), SAME * radius):
            continue
        what = f"walls {names[i]!r} and {names[k]!r} almost meet, at a distance of {width:.2g} m: a disc there touches both"
        remedy = f"give both the same point, to {SAME * radius:.1g} m; or leave a gap of more than {NEAR * radius:.2g} m"
        yield ("discs", "wall", k, "ends"), what, remedy


def _motion(wall: Any) -> tuple[Any, ...]:
    """How a wall moves: walls with different motions leave a gap on purpose."""
    return wall.velocity, wall.servo, wall.name if wall.servo is not None else ""


def _closed(lines: Any, between: Any, pair: tuple[int, int], tolerance: float) -> bool:
    """Whether other walls connect two walls beside the line `between` them."""
    import shapely

    room = shapely.buffer(between.centroid, AROUND * between.length)
    here = shapely.intersection(lines[shapely.intersects(lines, room)], room)
    joined = shapely.get_parts(shapely.union_all(shapely.buffer(here, tolerance)))
    first, last = (shapely.intersection(lines[number], room) for number in pair)
    return any(shapely.intersects(part, first) and shapely.intersects(part, last) for part in joined)


DOUBTS_OF_WALLS = (walls_that_almost_meet,)
