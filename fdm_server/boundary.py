"""Boundary conditions: which components of velocity are held at zero on which side of the grid."""

import numpy as np

from fdm_server.edges import boundary_edges

SIDES = ("left", "right", "bottom", "top", "face")


def side_of(grid, name):
    """Gridpoints of a side; top is the level ground surface, face its inclined or upright parts."""
    if name not in SIDES:
        raise ValueError(f"the grid has no side {name!r}: use one of {', '.join(SIDES)}")
    edges = boundary_edges(grid.zones)
    left, right, bottom, surface = _classes(grid, edges)
    a, b = grid.xy[edges[:, 0]], grid.xy[edges[:, 1]]
    level = np.abs(a[:, 1] - b[:, 1]) < _near(grid)
    chosen = {
        "left": left,
        "right": right,
        "bottom": bottom,
        "top": surface & level,
        "face": surface & ~level,
    }[name]
    return np.unique(edges[chosen])


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
