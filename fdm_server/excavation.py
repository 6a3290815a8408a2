"""Which zones an excavation takes, and whether the rest still hangs together."""

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from fdm_server.grid import centroids


def excavations(scene, grid, fixed, rims):
    """Zones {number of the stage: mask (Z,)} that each stage of kind excavate takes away; fixed (N,2): what boundaries hold.

    Raises ValueError for excavations that find nothing, touch a window, or leave pieces that hang on nothing.
    """
    there = np.ones(len(grid.zones), dtype=np.bool_)
    near_windows = np.zeros(len(grid.zones), dtype=np.bool_)
    for rim in rims:
        there &= ~rim.mask
        near_windows |= np.isin(grid.zones, rim.nodes).any(axis=1) | rim.mask
    masks = {}
    for index, stage in enumerate(scene.stage):
        if stage.kind == "excavate":
            masks[index] = _chosen(grid, stage.excavate) & there
            there = there & ~masks[index]
            if np.any(near_windows & _chosen(grid, stage.excavate)):
                raise ValueError(f"excavation {stage.name!r} touches a window: leave at least one zone between")
            if not np.any(masks[index]):
                raise ValueError(f"excavation {stage.name!r} finds no zones: is it above the ground, or dug away before?")
            if not all_held(grid.zones[there], fixed):
                raise ValueError(f"excavation {stage.name!r} leaves zones that nothing holds: take them away too")
    return masks


def _chosen(grid, excavate):
    """Zones (Z,) in the columns and rows, or with their centre in the polygon."""
    if excavate.polygon is not None:
        x, y = centroids(grid.xy, grid.zones).T
        return shapely.contains_xy(shapely.Polygon(excavate.polygon), x, y)
    (c0, c1), (r0, r1) = excavate.columns, excavate.rows
    return (grid.column >= c0) & (grid.column <= c1) & (grid.row >= r0) & (grid.row <= r1)


def all_held(zones, fixed):
    """Whether every piece of zones (A,4) is held in x and in y somewhere; fixed (N,2)."""
    piece = pieces(zones)
    held = [np.bincount(piece, np.any(fixed[zones, axis], axis=1)) > 0 for axis in range(2)]
    return bool(np.all(held))


def pieces(zones):
    """Number (A,) of the piece that each of zones (A,4) belongs to; sides join them, single gridpoints do not."""
    sides = np.sort(np.concatenate([zones[:, [k, (k + 1) % 4]] for k in range(4)]), axis=1)
    owner = np.tile(np.arange(len(zones)), 4)
    real = sides[:, 0] != sides[:, 1]  # not the repeated corner of a triangle
    _, side = np.unique(sides[real], axis=0, return_inverse=True)
    zone_by_side = coo_array((np.ones(len(side)), (owner[real], side.ravel())))
    return connected_components(zone_by_side @ zone_by_side.T, directed=False)[1]
