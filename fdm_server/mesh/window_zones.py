"""Windows: the zones that become a hole, and the rim to which the discs will be coupled."""

from typing import NamedTuple

import numpy as np

from coupler_protocol.geometry import spot
from fdm_server.mesh.grid import centroids, chosen_zones
from fdm_server.mesh.grid_sides import surface_edges
from fdm_server.mesh.zone_sides import boundary_edges, closed_loops, open_chains, pieces


class WindowRim(NamedTuple):
    """Rim of a window: gridpoints `nodes` (K,) around it, its zones on their left; at the ground surface also `surface` (S,).

    An open rim begins and ends on the ground surface; the gridpoints `surface` are between its last and its first node. They are
    None for a closed rim.
    """

    nodes: np.ndarray
    surface: np.ndarray | None

    @property
    def outline(self):
        """Gridpoints (K + S,) around the window, counter-clockwise."""
        return self.nodes if self.surface is None else np.concatenate([self.nodes, self.surface])


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


def window_rim(grid, mask):
    """The WindowRim of the zones in `mask` (Z,): open where they reach the ground surface; raises ValueError as `rim_of` does."""
    zones = grid.zones[mask]
    at_surface = len(zones) and grid.radii is None and _same_edges(boundary_edges(zones), surface_edges(grid, grid.zones)).any()
    return open_rim_of(grid, mask) if at_surface else WindowRim(rim_of(grid, mask), None)


def rim_of(grid, mask):
    """Gridpoints (K,) around the zones in `mask` (Z,), counter-clockwise, from the smallest index on.

    Raises ValueError, with the place, if the zones are not one piece without holes, meet in a gridpoint only, or touch a
    side or the ground surface.
    """
    zones, edges = _zones_and_sides(grid, mask)
    outer = np.intersect1d(edges, boundary_edges(grid.zones))
    if len(outer):
        where = _at(grid, grid.xy[outer[0]])
        raise ValueError(f"it touches the boundary of the grid {where}: leave at least one zone between")
    return _loop(grid, zones, edges)


def open_rim_of(grid, mask):
    """The open WindowRim of the zones in `mask` (Z,), which reach the ground surface in one stretch.

    Raises ValueError, with the place, as `rim_of` does, and if they touch another side, or the surface in two stretches.
    """
    zones, edges = _zones_and_sides(grid, mask)
    _loop(grid, zones, edges)
    surface = surface_edges(grid, grid.zones)
    at_surface = _same_edges(edges, surface)
    if not at_surface.any():
        raise ValueError("it does not reach the ground surface")
    inside, stretches = edges[~at_surface], open_chains(edges[at_surface])
    if len(stretches) > 1:
        where = _at(grid, grid.xy[stretches[1][0]])
        raise ValueError(f"it reaches the ground surface in {len(stretches)} stretches, one begins {where}: join them by zones")
    (chain,) = open_chains(inside)
    boundary = boundary_edges(grid.zones)
    sides = np.unique(boundary[~_same_edges(boundary, surface)])
    touching = np.concatenate([np.intersect1d(chain, sides), np.intersect1d(chain[1:-1], boundary)])
    if len(touching):
        where = _at(grid, grid.xy[touching[0]])
        raise ValueError(f"its rim touches the boundary of the grid {where}: leave at least one zone between")
    return WindowRim(chain, stretches[0][1:-1])


def _zones_and_sides(grid, mask):
    """The zones (A,4) in `mask` and their outer sides (E,2); raises ValueError if there are none."""
    zones = grid.zones[mask]
    if not len(zones):
        raise ValueError("the window contains no zones")
    return zones, boundary_edges(zones)


def _loop(grid, zones, edges):
    """The closed loop (K,) of the outer sides of `zones`; raises ValueError as `rim_of` does."""
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


def _same_edges(edges, others):
    """(E,) whether each directed side is one of `others` (F,2)."""
    size = max(edges.max(), others.max()) + 1
    return np.isin(edges[:, 0] * size + edges[:, 1], others[:, 0] * size + others[:, 1])


def _at(grid, point):
    return f"at {spot(point, grid.origin)}"
