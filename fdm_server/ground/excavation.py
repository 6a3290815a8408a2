"""Zones of excavations, and the support of the zones that remain."""

import numpy as np

from coupler_protocol.scene.schedule import acting_boundaries
from fdm_server.mesh.grid import chosen_zones
from fdm_server.mesh.grid_sides import fixed_components
from fdm_server.mesh.zone_sides import pieces


def held_in_stages(scene, grid):
    """Function that returns the held components (N,2) of the stage with this number."""
    return lambda index: fixed_components(grid, acting_boundaries(scene, index))


def excavations(scene, grid, fixed_in, rims):
    """Zones {number of the stage: mask (Z,)} that each excavation removes; fixed_in(stage): components (N,2) held in a stage.

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
            if not all_held(grid.zones[there], fixed_in(index)):
                raise ValueError(f"excavation {stage.name!r} leaves unsupported zones: excavate them too")
    return masks


def all_held(zones, fixed):
    """Whether every connected piece of zones (A,4) is held in x and in y somewhere; fixed (N,2)."""
    piece = pieces(zones)
    held = [np.bincount(piece, np.any(fixed[zones, axis], axis=1)) > 0 for axis in range(2)]
    return bool(np.all(held))
