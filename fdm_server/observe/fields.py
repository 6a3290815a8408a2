"""Fields of the active zones, computed from the state on demand."""

import numpy as np

from coupler_protocol.wire.payloads import field_rows
from fdm_server.mesh.grid import areas, centroids
from fdm_server.step import present_shape
from fdm_server.step.blocks import from_blocks, triangle_double_areas


def stress(model, state):
    """Stresses (A,4) [Pa] xx, yy, zz, xy of the active zones, mean of their triangles, tension positive."""
    rows = from_blocks(state.stress, len(model.zone))
    double = triangle_double_areas(present_shape.present(model, state), model.zones)
    share = 0.5 * double / (double[:, 0] + double[:, 1])[:, None]
    sm, zz = rows[:, 0], rows[:, 1]
    sd, xy = (share * rows[:, 2:6]).sum(axis=1), (share * rows[:, 6:10]).sum(axis=1)
    return np.column_stack([sm + sd, sm - sd, zz, xy])


def plastic_state(model, state):
    """Sums (A,) of 1 shear now, 2 tension now, 4 shear past, 8 tension past; zeros for a law without yield."""
    if state.plastic is None:
        return np.zeros(len(model.zone), dtype=np.int64)
    return from_blocks(state.plastic, len(model.zone))[:, 0]


def plastic_shear_strain(model, state):
    """Plastic shear strain (A,) [-] of softening; a material must soften."""
    return from_blocks(state.plastic_shear, len(model.zone))[:, 0]


def history(model, state, name):
    """History (A,) with this name in the active zones."""
    return from_blocks(state.history(name), len(model.zone))[:, 0]


def shear_strain(model, state):
    """Largest engineering shear strain (A,) [-] of the zones, from their displacement.

    Small strain: hypot(eps_xx - eps_yy, gamma_xy) of the mean displacement gradient. Large strain: the difference of the
    principal logarithmic strains, which does not include rotation; the same to first order.
    """
    gradient = mean_gradient(model.grid.xy, model.zones, state.displacement)
    if state.mass is None:
        return _max_shear(gradient)
    F = gradient + np.eye(2)
    C = np.einsum("zki,zkj->zij", F, F)
    mean, radius = 0.5 * (C[:, 0, 0] + C[:, 1, 1]), np.hypot(0.5 * (C[:, 0, 0] - C[:, 1, 1]), C[:, 0, 1])
    return np.log((mean + radius) / np.abs(np.linalg.det(F)))  # mean ± radius: squares of the stretches, their product det^2


def shear_strain_rate(model, state):
    """Largest engineering shear strain rate (A,) [1/s] of the zones' present shape."""
    return _max_shear(mean_gradient(present_shape.present(model, state), model.zones, state.velocity))


def mean_gradient(xy, zones, motion):
    """Mean gradients (Z,2,2), d(motion_i)/dx_j, of `motion` (N,2) over zones (Z,4) with gridpoints at xy (N,2) [m]."""
    # gradient of N_k over a zone: half of the opposite side, rotated by 90 degrees, over the area
    across = np.roll(xy[zones], -1, axis=1) - np.roll(xy[zones], 1, axis=1)
    turned = np.stack([across[:, :, 1], -across[:, :, 0]], axis=2) / (2.0 * areas(xy, zones))[:, None, None]
    return np.einsum("zki,zkj->zij", motion[zones], turned)


def _max_shear(gradient):
    return np.hypot(gradient[:, 0, 0] - gradient[:, 1, 1], gradient[:, 0, 1] + gradient[:, 1, 0])


def zone_field(model, state, mask):
    """Rows (n,7) of the message FIELD (coupler_protocol.wire.payloads) for the zones in `mask` (Z of the grid,).

    All zones in `mask` must be active.
    """
    chosen = mask[model.zone]
    zones = model.zones[chosen]
    s = stress(model, state)[chosen]
    xy = model.grid.xy
    return field_rows(centroids(xy, zones), areas(xy, zones), s[:, [0, 1, 3]], model.zone_density[chosen])
