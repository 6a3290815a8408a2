"""Doubts about places: where boundaries, loads and excavations act, against where the scene draws them.

A motion acts on gridpoints, an excavation takes whole zones. What is drawn beyond a side or beyond the ground acts on nothing.
"""

import numpy as np
import shapely

from coupler_protocol.geometry import spot_on
from fdm_server.checks.materials import AREA, ground_of
from fdm_server.mesh.grid import areas, chosen_zones
from fdm_server.mesh.grid_sides import as_drawn, edges_of, points_in, sides_of

LENGTH = 0.05  # of the length of a range: a larger difference is doubted


def doubts_of_places(scene, grid):
    """Doubts (path, what, remedy) about ranges of boundaries and about excavations."""
    tables = [(("boundary", k), b) for k, b in enumerate(scene.boundary)]
    tables += [(("stage", i, "boundary", k), b) for i, stage in enumerate(scene.stage) for k, b in enumerate(stage.boundary)]
    for path, boundary in tables:
        for axis, name in enumerate("xy"):
            span = getattr(boundary, name)
            if span is not None:
                found = _load_range(grid, boundary, axis, span) if boundary.loads else _motion_range(grid, boundary, axis, span)
                if found:
                    yield (*path, name), *found
    yield from _excavations(scene, grid)


def _motion_range(grid, boundary, axis, span):
    """A range that ends between gridpoints: another width than drawn is moved. One gridpoint alone is chosen on purpose."""
    side = sides_of(grid)[boundary.on]
    all_along, along = grid.xy[np.unique(side), axis], grid.xy[points_in(grid, sides_of(grid), boundary), axis]
    reached = along.min(), along.max()
    drawn = max(span[0], all_along.min()), min(span[1], all_along.max())
    width = reached[1] - reached[0]
    if width <= 0.0 or max(abs(reached[0] - drawn[0]), abs(reached[1] - drawn[1])) <= LENGTH * width:
        return None
    start = grid.origin[axis]
    from_, to = (spot_on(end, start) for end in reached)
    what = f"{as_drawn(grid, boundary).summary} acts on gridpoints from {from_} to {to} m: the range ends between gridpoints"
    below, above = all_along[all_along < reached[0]], all_along[all_along > reached[1]]
    first = from_ + (f" or {spot_on(below.max(), start)}" if reached[0] > drawn[0] and len(below) else "")
    last = to + (f" or {spot_on(above.min(), start)}" if reached[1] < drawn[1] and len(above) else "")
    return what, f"let it begin at {first} and end at {last} m, or use zones that divide it"


def _load_range(grid, boundary, axis, span):
    """A load that is drawn beyond its side."""
    if boundary.x is not None and boundary.y is not None:
        return None
    ends = np.sort(grid.xy[edges_of(grid, boundary.on)][:, :, axis], axis=1)
    covered = float(np.clip(np.minimum(ends[:, 1], span[1]) - np.maximum(ends[:, 0], span[0]), 0.0, None).sum())
    if covered >= (1.0 - LENGTH) * (span[1] - span[0]):
        return None
    low, high = (spot_on(end, grid.origin[axis]) for end in (ends.min(), ends.max()))
    what = f"{as_drawn(grid, boundary).summary} acts on {covered:.3g} of {span[1] - span[0]:.3g} m: the side {boundary.on} has "
    what += "no more there"
    return what, f"end the range with the side, which lies between {low} and {high} m"


def _excavations(scene, grid):
    """Excavations whose zones have another area than their drawing in the ground, or are counted beyond the grid."""
    size, there, ground = areas(grid.xy, grid.zones), np.ones(len(grid.zones), dtype=np.bool_), None
    for i, stage in enumerate(scene.stage):
        table = stage.excavate
        if table is None:
            continue
        zones = chosen_zones(grid, table) & there
        there &= ~zones
        if table.polygon is None:
            for key, last in (("columns", grid.column.max()), ("rows", grid.row.max())):
                if getattr(table, key)[1] > last:
                    what = (
                        f"excavation {stage.name!r} ends at {key[:-1]} {getattr(table, key)[1]}: the grid has {key} 0 .. {last}"
                    )
                    yield ("stage", i, "excavate", key), what, f"use at most {last}"
            ground = (
                None if ground is None else ground.difference(shapely.union_all(shapely.polygons(grid.xy[grid.zones[zones]])))
            )
            continue
        ground = _ground_before(scene, grid, i) if ground is None else ground
        polygon = shapely.Polygon(table.polygon)
        drawn, dug = ground.intersection(polygon).area, float(size[zones].sum())
        ground = ground.difference(polygon)
        if drawn > 0.0 and abs(dug / drawn - 1.0) > AREA:
            what = f"excavation {stage.name!r} removes zones of {dug:.4g} m2, {100 * (dug / drawn - 1):+.2g} % of the "
            what += f"{drawn:.4g} m2 drawn"
            yield ("stage", i, "excavate", "polygon"), what, "draw it along zones, or use smaller zones there"


def _ground_before(scene, grid, index):
    """The ground as drawn, without what excavations by columns and rows took before the stage with this number."""
    gone = [chosen_zones(grid, s.excavate) for s in scene.stage[:index] if s.excavate is not None]
    ground = ground_of(scene, grid)
    return ground.difference(shapely.union_all([shapely.union_all(shapely.polygons(grid.xy[grid.zones[m]])) for m in gone]))
