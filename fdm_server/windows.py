"""Windows: the zones that become a hole, and the rim on which the discs will be hung."""

import numpy as np

from fdm_server.edges import boundary_edges, closed_loop


def window_zones(grid, window):
    """Which zones (Z,) lie in the window's columns and rows, both ends included."""
    (c0, c1), (r0, r1) = window.columns, window.rows
    mask = (grid.column >= c0) & (grid.column <= c1) & (grid.row >= r0) & (grid.row <= r1)
    wanted = (c1 - c0 + 1) * (r1 - r0 + 1)
    if mask.sum() != wanted or np.any(grid.triangular & mask):
        raise ValueError(
            f"window {window.name!r} reaches beyond the ground surface or the sides, or a line cuts its cells: only "
            f"{np.sum(mask & ~grid.triangular)} of its {wanted} cells are whole zones; move it inwards"
        )
    corners = grid.xy[grid.zones[mask]]
    sloping = np.abs(np.roll(corners, -1, axis=1) - corners).min(axis=2) > 1e-9 * np.ptp(corners)
    if np.any(sloping):
        x, y = corners[np.any(sloping, axis=1)][0].mean(axis=0)
        raise ValueError(
            f"window {window.name!r} holds zones that are no rectangles, one at ({x:.4g}, {y:.4g}): move it away from the "
            f"ground surface and from tops of materials, which zones follow"
        )
    return mask


def rim_of(grid, mask):
    """Gridpoints (K,) around the zones in `mask` (Z,), counter-clockwise, from the smallest index on.

    Raises ValueError for zones that touch a side or the ground surface, or are not one piece.
    """
    if not np.any(mask):
        raise ValueError("the window holds no zones")
    rim = closed_loop(boundary_edges(grid.zones[mask]))
    outer = np.intersect1d(rim, boundary_edges(grid.zones))
    if len(outer):
        x, y = grid.xy[outer[0]]
        raise ValueError(
            f"the window touches the boundary of the grid at ({x:g}, {y:g}): leave at least one zone between"
        )
    return rim
