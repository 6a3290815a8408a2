"""Boundary conditions: which components of velocity are held at zero on which side of the grid."""

import numpy as np

from fdm_server.edges import boundary_edges

SIDES = ("left", "right", "bottom", "top", "face")


def side_of(grid, name):
    """Gridpoints of a side; top is the level ground surface, face its inclined or upright parts."""
    if name not in SIDES:
        raise ValueError(f"the grid has no side {name!r}: use one of {', '.join(SIDES)}")
    edges = boundary_edges(grid.zones)
    a, b = grid.xy[edges[:, 0]], grid.xy[edges[:, 1]]
    low, high = grid.xy.min(axis=0), grid.xy.max(axis=0)
    near = 1e-9 * (high - low).max()

    def on(axis, value):
        return (np.abs(a[:, axis] - value) < near) & (np.abs(b[:, axis] - value) < near)

    left, right, bottom = on(0, low[0]), on(0, high[0]), on(1, low[1])
    surface = ~(left | right | bottom)
    level = np.abs(a[:, 1] - b[:, 1]) < near
    chosen = {
        "left": left,
        "right": right,
        "bottom": bottom,
        "top": surface & level,
        "face": surface & ~level,
    }[name]
    return np.unique(edges[chosen])


def fixed_components(grid, boundaries):
    """Which components of velocity stay zero (N,2), from the scene's list of {on, fix}."""
    fixed = np.zeros(grid.xy.shape, dtype=np.bool_)
    for boundary in boundaries:
        points = side_of(grid, boundary.on)
        for axis, letter in enumerate("xy"):
            if letter in boundary.fix:
                fixed[points, axis] = True
    return fixed
