"""Boundary conditions: which components of velocity are held at zero on which side of the grid."""

import numpy as np

from fdm_server.edges import boundary_edges


def side_of(grid, name):
    """Gridpoints of a side; top is the level ground surface, face its inclined or upright parts.

    A ring has the sides inner and outer, and where it is no full one bottom (y = 0) and left (x = 0).
    """
    return np.unique(edges_of(grid, name))


def edges_of(grid, name):
    """Sides of zones (E,2) that form a side of the grid, with the zones on their left."""
    edges = boundary_edges(grid.zones)
    a, b = grid.xy[edges[:, 0]], grid.xy[edges[:, 1]]
    left, right, bottom, surface = _classes(grid, edges)
    if grid.radii is None:
        level = np.abs(a[:, 1] - b[:, 1]) < _near(grid)
        sides = {"left": left, "right": right, "bottom": bottom, "top": surface & level, "face": surface & ~level}
    else:
        inner, outer = (
            np.all([np.abs(np.hypot(*p.T) - radius) < _near(grid) for p in (a, b)], axis=0) for radius in grid.radii
        )
        sides = {"inner": inner, "outer": outer, "left": left & ~outer, "bottom": bottom & ~outer}
    if name not in sides or (grid.radii is not None and not np.any(sides[name])):
        there = [side for side in sides if grid.radii is None or np.any(sides[side])]
        raise ValueError(f"the grid has no side {name!r}: use one of {', '.join(there)}")
    return edges[sides[name]]


def surface_edges(grid, zones, rims=()):
    """Ground surface of `zones` (A,4): sides (E,2) that bound them, but not the grid at left, right and bottom nor a window.

    rims: gridpoints of the windows' rims. The zones lie on the left of the sides.
    """
    edges = boundary_edges(zones)
    surface = _classes(grid, edges)[3]
    for rim in rims:
        surface &= ~np.isin(edges, rim).all(axis=1)
    return edges[surface]


def _near(grid):
    return 1e-9 * (grid.xy.max(axis=0) - grid.xy.min(axis=0)).max()


def _classes(grid, edges):
    """Which of the sides (E,2) lie on the left, on the right, at the bottom of the grid, or elsewhere."""
    a, b = grid.xy[edges[:, 0]], grid.xy[edges[:, 1]]
    low, high, near = grid.xy.min(axis=0), grid.xy.max(axis=0), _near(grid)

    def on(axis, value):
        return (np.abs(a[:, axis] - value) < near) & (np.abs(b[:, axis] - value) < near)

    left, right, bottom = on(0, low[0]), on(0, high[0]), on(1, low[1])
    return left, right, bottom, ~(left | right | bottom)


def fixed_components(grid, boundaries):
    """Which components of velocity stay zero (N,2), from the scene's list of {on, fix}."""
    fixed = np.zeros(grid.xy.shape, dtype=np.bool_)
    for boundary in boundaries:
        points = side_of(grid, boundary.on)
        for axis, letter in enumerate("xy"):
            if letter in boundary.fix:
                fixed[points, axis] = True
    return fixed
