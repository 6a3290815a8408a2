"""Zones of excavations, and the support of the zones that remain."""

import numpy as np

from fdm_server.mesh.grid import chosen_zones
from fdm_server.mesh.zone_sides import pieces


def excavations(scene, grid, fixed, rims):
    """Zones {number of the stage: mask (Z,)} that each excavation removes; fixed (N,2): held components.

    Raises ValueError for excavations that contain no zones, touch a window, or leave unsupported zones.
    """
    there = np.ones(len(grid.zones), dtype=np.bool_)
    near_windows = np.zeros(len(grid.zones), dtype=np.bool_)
    for rim in rims:
        there &= ~rim.mask
        near_windows |= np.isin(grid.zones, rim.nodes).any(axis=1) | rim.mask
    masks = {}
    for index, stage in enumerate(scene.stage):
        if stage.excavate is not None:
            masks[index] = chosen_zones(grid, stage.excavate) & there
            there = there & ~masks[index]
            if np.any(near_windows & chosen_zones(grid, stage.excavate)):
                raise ValueError(f"excavation {stage.name!r} touches a window: leave at least one zone between")
            if not np.any(masks[index]):
                raise ValueError(f"excavation {stage.name!r} contains no zones: is it above the ground, or already excavated?")
            if not np.any(there):
                raise ValueError(f"excavation {stage.name!r} removes all the ground that is left: leave some of it")
            if not all_held(grid.zones[there], fixed):
                raise ValueError(f"excavation {stage.name!r} leaves unsupported zones: excavate them too")
    return masks


def all_held(zones, fixed):
    """Whether every connected piece of zones (A,4) is held in x and in y somewhere; fixed (N,2)."""
    piece = pieces(zones)
    held = [np.bincount(piece, np.any(fixed[zones, axis], axis=1)) > 0 for axis in range(2)]
    return bool(np.all(held))
