"""Rules that a scene must fulfil so that its grid can be built; found by the scene reader through `colluvium.rules`."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coupler_protocol.geometry import spot
from coupler_protocol.scene.of_window import of_window
from fdm_server.checks.materials import materials_have_zones
from fdm_server.checks.motions import motions_can_be_read
from fdm_server.checks.room_for_discs import lack_of_room
from fdm_server.ground.even_loads import forces_of_even_loads
from fdm_server.ground.excavation import excavations, held_in_stages
from fdm_server.mesh.grid import build_grid, centroids
from fdm_server.mesh.grid_sides import as_drawn, edges_of, extent_of, points_in, sides_of, surface_edges
from fdm_server.mesh.window_zones import window_rim, window_zones


class _Hole(NamedTuple):
    """Zones and rim of a window, as an argument of `excavations`."""

    mask: NDArray[np.bool_]
    nodes: NDArray[np.int64]
    outline: NDArray[np.int64]


def grid_can_be_built(scene):
    """Profile, zone size, regions and boundaries are consistent; windows are whole zones, and no zones lose their support."""
    if scene.grid is None:
        return
    try:
        grid = build_grid(scene)
    except ValueError as error:
        yield ("grid",), str(error), ""
        return
    misplaced = [*materials_have_zones(scene, grid), *_misplaced(scene, grid)]
    yield from misplaced
    if misplaced:
        return
    holes = {}
    for i, window in enumerate(scene.window):
        try:
            holes[i] = _hole(grid, window)
        except ValueError as error:
            yield ("window", i), str(error), ""
    yield from _cramped(scene, grid, holes)
    yield from _on_windows(scene, grid, holes)
    yield from motions_can_be_read(scene)
    try:
        excavations(scene, grid, held_in_stages(scene, grid), list(holes.values()))
    except ValueError as error:
        yield ("stage",), str(error), ""


def _hole(grid, window):
    """The _Hole of a window; raises ValueError that begins with its name."""
    mask = window_zones(grid, window)
    try:
        rim = window_rim(grid, mask)
        return _Hole(mask, rim.nodes, rim.outline)
    except ValueError as error:
        raise ValueError(f"window {window.name!r}: {error}") from None


def _cramped(scene, grid, holes):
    """Yields problems of windows {number: hole} without a zone between them, or too small for their discs."""
    for i, hole in holes.items():
        for j, other in holes.items():
            problem = _touching(grid, hole, other) if j < i else ""
            if problem:
                what = f"window {scene.window[i].name!r} {problem.format(repr(scene.window[j].name))}"
                yield ("window", i), what, "leave at least one zone between windows"
        lack = lack_of_room(grid.xy[hole.outline], of_window(scene, i + 1).discs.radius, grid.origin)
        if lack:
            yield ("window", i), f"window {scene.window[i].name!r} {lack[0]}", lack[1]


def _on_windows(scene, grid, holes):
    """Yields problems of boundaries and loads on the ground surface of windows {number: hole}: no zones would carry them."""
    tables = [(("boundary", k), b) for k, b in enumerate(scene.boundary) if b.free is None]
    for i, stage in enumerate(scene.stage):
        tables += [(("stage", i, "boundary", k), b) for k, b in enumerate(stage.boundary) if b.free is None]
    sides = sides_of(grid)
    acting = [(path, points_in(grid, sides, boundary)) for path, boundary in tables]
    surface = np.unique(surface_edges(grid, grid.zones))
    for i, stage in enumerate(scene.stage):
        if stage.surcharge is not None:
            x = grid.xy[surface, 0]
            acting.append((("stage", i, "surcharge"), surface[(x > stage.surcharge.x[0]) & (x < stage.surcharge.x[1])]))
    for i, hole in holes.items():
        above = np.setdiff1d(hole.outline, hole.nodes)
        told = set()
        for path, points in acting:
            if len(np.intersect1d(points, above)):
                told.add(path)
                what = f"this acts on the ground surface of window {scene.window[i].name!r}, which is open to its discs"
                yield path, what, "end it beside the window: x = [first, last]"
        if len(above):
            yield from (found for found in _beside_window(scene, grid, scene.window[i].name, hole) if found[0] not in told)


def _beside_window(scene, grid, name, hole):
    """Yields loads on the sides of zones that end at an open rim: the forces of the discs replace theirs at its ends."""
    edges = surface_edges(grid, grid.zones)
    at_end = np.isin(edges, hole.nodes[[0, -1]]).any(axis=1) & ~np.isin(edges, hole.outline).all(axis=1)
    low, high = np.sort(grid.xy[edges[at_end]], axis=1).transpose(1, 0, 2)
    loads = [(("boundary", k), b) for k, b in enumerate(scene.boundary) if b.loads]
    for i, stage in enumerate(scene.stage):
        loads += [(("stage", i, "boundary", k), b) for k, b in enumerate(stage.boundary) if b.loads]
        if stage.surcharge is not None:
            loads.append((("stage", i, "surcharge"), stage.surcharge))
    for path, load in loads:
        there = np.ones(len(low), dtype=np.bool_)
        if hasattr(load, "on"):
            there &= np.isin(edges[at_end], edges_of(grid, load.on)).all(axis=1)
        for axis, span in enumerate((load.x, getattr(load, "y", None))):
            if span is not None:
                wide = high[:, axis] > low[:, axis]
                there &= ~wide | ((low[:, axis] < span[1]) & (high[:, axis] > span[0]))
        if there.any():
            what = f"this loads a zone at the end of the rim of window {name!r}, whose discs move that gridpoint"
            yield path, what, "leave one zone between the load and the window: x = [first, last]"


def _touching(grid, hole, other):
    """What two holes have in common, in words with {} for the name of the other one; "" if there is a zone between them."""
    shared = np.flatnonzero(hole.mask & other.mask)
    if len(shared):
        at = spot(centroids(grid.xy, grid.zones[shared[:1]])[0], grid.origin)
        return f"overlaps window {{}} in {len(shared)} zone{'s' if len(shared) > 1 else ''}, one at {at}"
    common = np.intersect1d(hole.outline, other.outline)
    if not len(common):
        return ""
    at, many = spot(grid.xy[common[0]], grid.origin), "s" if len(common) > 1 else ""
    return f"touches window {{}} in {len(common)} gridpoint{many}, at {at}"


def _misplaced(scene, grid):
    """Yields problems of boundaries on sides that the grid does not have, or outside the extent of a side."""
    tables = [(("boundary", k), b) for k, b in enumerate(scene.boundary)]
    tables += [(("stage", i, "boundary", k), b) for i, stage in enumerate(scene.stage) for k, b in enumerate(stage.boundary)]
    sides = sides_of(grid)
    for path, boundary in tables:
        try:
            points = points_in(grid, sides, boundary) if not boundary.loads else edges_of(grid, boundary.on)
            if boundary.loads and not np.any(
                forces_of_even_loads(grid.xy, points, np.ones(points.shape), boundary.x, boundary.y)
            ):
                yield path, f"no part of the side lies in {as_drawn(grid, boundary).place!r}", extent_of(grid, boundary.on)
        except ValueError as error:
            yield path, str(error), ""
