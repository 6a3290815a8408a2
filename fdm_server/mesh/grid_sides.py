"""Sides of the grid, and the components of velocity that the boundaries of a scene hold or prescribe there."""

import numpy as np

from coupler_protocol.geometry import spot_on
from coupler_protocol.scene.local_origin import counted
from fdm_server.mesh.zone_sides import boundary_edges


def side_of(grid, name):
    """Gridpoints of a side; top is the level ground surface, face its inclined or vertical parts.

    A ring has the sides inner and outer; a half or quarter ring also bottom (y = 0), a quarter also left (x = 0).
    """
    return np.unique(edges_of(grid, name))


def edges_of(grid, name):
    """Sides of zones (E,2) that form a side of the grid, zones on their left; raises ValueError for an unknown side."""
    return _named(sides_of(grid), name)


def sides_of(grid):
    """All sides of the grid {name: sides of zones (E,2)}."""
    edges = boundary_edges(grid.zones)
    a, b = grid.xy[edges[:, 0]], grid.xy[edges[:, 1]]
    left, right, bottom, surface = _classes(grid, edges)
    if grid.radii is None:
        level = np.abs(a[:, 1] - b[:, 1]) < _near(grid)
        chosen = {"left": left, "right": right, "bottom": bottom, "top": surface & level, "face": surface & ~level}
        return {name: edges[mask] for name, mask in chosen.items()}
    inner, outer = (np.all([np.abs(np.hypot(*p.T) - radius) < _near(grid) for p in (a, b)], axis=0) for radius in grid.radii)
    chosen = {"inner": inner, "outer": outer, "left": left & ~outer, "bottom": bottom & ~outer}
    return {name: edges[mask] for name, mask in chosen.items() if np.any(mask)}


def _named(sides, name):
    if name not in sides:
        raise ValueError(f"the grid has no side {name!r}: use one of {', '.join(sides)}")
    return sides[name]


def surface_edges(grid, zones, rims=()):
    """Ground surface of `zones` (A,4): their outer sides (E,2), without left, right and bottom of the grid and without windows.

    rims: gridpoints of the windows' rims. The zones are on the left of the sides.
    """
    edges = boundary_edges(zones)
    surface = _classes(grid, edges)[3]
    for rim in rims:
        surface &= ~np.isin(edges, rim).all(axis=1)
    return edges[surface]


def _near(grid):
    return 1e-9 * (grid.xy.max(axis=0) - grid.xy.min(axis=0)).max()


def _classes(grid, edges):
    """Whether each of the sides (E,2) is on the left, on the right, at the bottom of the grid, or elsewhere: four masks (E,)."""
    a, b = grid.xy[edges[:, 0]], grid.xy[edges[:, 1]]
    low, high, near = grid.xy.min(axis=0), grid.xy.max(axis=0), _near(grid)

    def on(axis, value):
        return (np.abs(a[:, axis] - value) < near) & (np.abs(b[:, axis] - value) < near)

    left, right, bottom = on(0, low[0]), on(0, high[0]), on(1, low[1])
    return left, right, bottom, ~(left | right | bottom)


def points_in(grid, sides, boundary):
    """Gridpoints of the side (of `sides_of`) and range of a boundary; raises ValueError if there are none."""
    points = np.unique(_named(sides, boundary.on))
    inside = np.ones(len(points), dtype=np.bool_)
    for axis, span in enumerate((boundary.x, boundary.y)):
        if span is not None:
            at = grid.xy[points, axis]
            inside &= (at >= span[0] - _near(grid)) & (at <= span[1] + _near(grid))
    if not np.any(inside):
        raise ValueError(f"no gridpoint lies in {as_drawn(grid, boundary).place!r}: {extent_of(grid, boundary.on)}")
    return points[inside]


def extent_of(grid, name):
    """Text with the extent of a side."""
    xy = grid.xy[side_of(grid, name)]
    if not len(xy):
        return f"the grid has no {name}"
    (x0, x1), (y0, y1) = ([spot_on(end, start) for end in (v.min(), v.max())] for v, start in zip(xy.T, grid.origin, strict=True))
    return f"the {name} has {len(xy)} gridpoints, from x = {x0} to {x1} and from y = {y0} to {y1} m"


def as_drawn(grid, boundary):
    """A boundary with its range in the coordinates of the scene."""
    return counted(boundary, -np.array(grid.origin))


def motion_of(boundary):
    """Components (axis, velocity [m/step] or None for a free one) whose motion a boundary sets."""
    if boundary.velocity is not None:
        return [(k, v) for k, v in enumerate((boundary.velocity.x, boundary.velocity.y)) if v is not None]
    if boundary.is_quiet:
        return [(0, None), (1, None)]
    if boundary.shaking is not None:
        return [("xy".index(column), 0.0) for column in boundary.shaking.factors]  # after the motion it is held
    if boundary.free is not None:
        return [("xy".index(letter), None) for letter in boundary.free]
    return [("xy".index(letter), 0.0) for letter in boundary.fix or ""]


def fixed_components(grid, boundaries):
    """(N,2) whether a component of velocity is held or prescribed; the last of several boundaries counts."""
    fixed, sides = np.zeros(grid.xy.shape, dtype=np.bool_), sides_of(grid)
    for boundary in boundaries:
        for axis, velocity in motion_of(boundary):
            fixed[points_in(grid, sides, boundary), axis] = velocity is not None
    return fixed
