"""Porosity and packing of a window compared with polygons.

A scene fills an L-shaped window with discs of 0.04 m, spread 0.25, at 100 kPa. `run.porosity` (areas of discs cut by a circle
or a polygon in closed form, less their overlaps) against the union of polygons of 256 sides, made and cut by shapely; the
porosity asked for, 0.16, against that of the middle of the window, which is denser than the rows along its edges; and the
radii against those asked for."""

import numpy as np
import shapely

from verification.discrete import scenes
from verification.verdict_rows import row

NAME = "porosity"
WINDOW = [[0.0, 0.0], [2.4, 0.0], [2.4, 1.2], [1.2, 1.2], [1.2, 2.4], [0.0, 2.4]]
INNER = [[0.15, 0.15], [2.25, 0.15], [2.25, 1.05], [1.05, 1.05], [1.05, 2.25], [0.15, 2.25]]
CIRCLE = (0.62, 0.71, 0.4)
RADIUS, SPREAD, ASKED = 0.04, 0.25, 0.16


def covered(discs, region):
    """Porosity of a shapely polygon from the union of many-sided discs of the right area."""
    sides = 256
    exact = np.sqrt(2.0 * np.pi / sides / np.sin(2.0 * np.pi / sides))
    shapes = shapely.buffer(shapely.points(discs.xy), exact * discs.radius, quad_segs=sides // 4)
    return 1.0 - shapely.union_all(shapes).intersection(region).area / region.area


def rows(fast):
    """One packing."""
    stage = {"name": "look", "kind": "discs", "until": {"steps": 1}}
    soil = {key: table for key, table in scenes.SOIL.items() if key != "friction"}
    window = [{"name": "L", "polygon": WINDOW}]
    discs = {"radius": RADIUS, "spread": SPREAD, "porosity": ASKED, "confinement": 1e5, "soil": soil}
    with scenes.of_tables(scenes.tables([stage], discs, window=window)) as run:
        discs, shape = run.discs(0), shapely.Polygon(INNER)
        found = run.porosity(0, INNER)
        yield row(
            "porosity of the L within 0.15 m of its edges", found, covered(discs, shape), 1e-3, "shapely, union of polygons"
        )
        yield row("porosity of the same against what was asked for", found, ASKED, [-0.1, 0.05], "as asked for")
        circle = shapely.Point(CIRCLE[:2]).buffer(CIRCLE[2], quad_segs=512)
        yield row("porosity of a circle", run.porosity(0, CIRCLE), covered(discs, circle), 1e-3, "shapely, union of polygons")
        mean, deviation = discs.radius.mean(), RADIUS * SPREAD / 3.0**0.5
        error = 3.5 * deviation / RADIUS / len(discs.radius) ** 0.5
        yield row(f"mean radius of {len(discs.radius)} discs over the one asked for", mean / RADIUS, 1.0, error + 0.02, "uniform")
