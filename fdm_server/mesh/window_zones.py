"""Windows: the zones that become a hole, and the rim to which the discs will be coupled."""

import numpy as np

from coupler_protocol.geometry import spot
from fdm_server.mesh.grid import centroids, chosen_zones
from fdm_server.mesh.zone_sides import boundary_edges, closed_loops, pieces


def window_zones(grid, window):
    """(Z,) whether a zone becomes the hole: it is in columns and rows, both ends included, or has its centre in the polygon."""
    mask = chosen_zones(grid, window)
    if window.polygon is not None:
        if not np.any(mask):
            raise ValueError(f"window {window.name!r} contains no zones: none has its centre in the polygon")
        return mask
    (c0, c1), (r0, r1) = window.columns, window.rows
    wanted = (c1 - c0 + 1) * (r1 - r0 + 1)
    if mask.sum() != wanted or np.any(grid.triangular & mask):
        raise ValueError(
            f"window {window.name!r} reaches beyond the ground surface or the sides, or a line cuts its cells: only "
            f"{np.sum(mask & ~grid.triangular)} of its {wanted} cells are whole zones; move it inwards"
        )
    return mask


def rim_of(grid, mask):
    """Gridpoints (K,) around the zones in `mask` (Z,), counter-clockwise, from the smallest index on.

    Raises ValueError, with the place, if the zones are not one piece without holes, meet in a gridpoint only, or touch a
    side or the ground surface.
    """
    zones = grid.zones[mask]
    if not len(zones):
        raise ValueError("the window contains no zones")
    edges = boundary_edges(zones)
    outer = np.intersect1d(edges, boundary_edges(grid.zones))
    if len(outer):
        where = _at(grid, grid.xy[outer[0]])
        raise ValueError(f"it touches the boundary of the grid {where}: leave at least one zone between")
    points, ends = np.unique(edges[:, 0], return_counts=True)
    if ends.max() > 1:
        where = _at(grid, grid.xy[points[ends.argmax()]])
        raise ValueError(f"its zones meet in a single gridpoint {where}: join them by a side or separate them")
    piece = pieces(zones)
    if piece.max() > 0:
        smallest = np.bincount(piece).argmin()
        where = _at(grid, centroids(grid.xy, zones[piece == smallest]).mean(axis=0))
        raise ValueError(f"its zones form {piece.max() + 1} separate pieces, the smallest at {where[3:]}: join them")
    loops = closed_loops(edges)
    if len(loops) > 1:
        inner = min(loops, key=lambda loop: np.ptp(grid.xy[loop], axis=0).max())
        where = _at(grid, grid.xy[inner].mean(axis=0))
        raise ValueError(f"the window has a hole {where}: add the zones in it to the window")
    return loops[0]


def _at(grid, point):
    return f"at {spot(point, grid.origin)}"
