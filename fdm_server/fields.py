"""Fields of the active zones, made from the state when someone looks; steps keep none of them."""

import numpy as np

from fdm_server.blocks import from_blocks
from fdm_server.grid import areas, centroids


def stress(model, state):
    """Stresses (A,4) [Pa] xx, yy, zz, xy of the active zones, mean of their triangles, tension positive."""
    rows = from_blocks(state.stress, len(model.zone))
    share = 0.5 * from_blocks(model.geometry.share, len(model.zone))
    sm, zz = rows[:, 0], rows[:, 1]
    sd, xy = (share * rows[:, 2:6]).sum(axis=1), (share * rows[:, 6:10]).sum(axis=1)
    return np.column_stack([sm + sd, sm - sd, zz, xy])


def plastic_state(model, state):
    """Sums (A,) of 1 shear now, 2 tension now, 4 shear past, 8 tension past; zeros where nothing yields."""
    if state.plastic is None:
        return np.zeros(len(model.zone), dtype=np.int64)
    return from_blocks(state.plastic, len(model.zone))[:, 0]


def max_shear(model, motion):
    """Largest engineering shear strain (A,) of the zones' mean gradient of `motion` (N,2).

    Displacements [m] give a strain [-], velocities [m/s] a rate [1/s]: hypot(eps_xx - eps_yy, gamma_xy).
    """
    xy, zones = model.grid.xy, model.zones
    u = motion[zones]
    # gradient of N_k over a zone: half the opposite side turned by 90 degrees, over the area
    across = np.roll(xy[zones], -1, axis=1) - np.roll(xy[zones], 1, axis=1)
    area = 2.0 * areas(xy, zones)[:, None]
    dx = np.einsum("zk,zkc->zc", across[:, :, 1], u) / area
    dy = np.einsum("zk,zkc->zc", -across[:, :, 0], u) / area
    return np.hypot(dx[:, 0] - dy[:, 1], dy[:, 0] + dx[:, 1])


def zone_field(model, state, mask):
    """What the discs of a window start from, for the zones in `mask` (Z of the grid,), which must be active.

    Columns (n,7): x, y of the centroid [m], area [m2], stresses xx, yy, xy [Pa], density [kg/m3].
    """
    chosen = mask[model.zone]
    zones = model.zones[chosen]
    s = stress(model, state)[chosen]
    return np.column_stack(
        [
            centroids(model.grid.xy, zones),
            areas(model.grid.xy, zones),
            s[:, 0],
            s[:, 1],
            s[:, 3],
            model.zone_density[chosen],
        ]
    )
