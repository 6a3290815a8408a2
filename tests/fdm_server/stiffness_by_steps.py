"""A coarse elastic slope and its stiffness as steps of the kernels give it, column by column."""

import numpy as np
from grid_cases import material, slope

from fdm_server.mesh.grid import build_grid
from fdm_server.model import build_model, new_state
from fdm_server.step.zone_pass import advance

SOFT = [material(mohr_coulomb=None, tension=None)]
BENCH = [(0, 4), (4, 4), (12, 12), (20, 12)]


def elastic_slope(elastic=SOFT[0].elastic, shake=0.0):
    """Model of the slope; shake: free gridpoints moved by up to so much [m] each way."""
    scene = slope(2.0, BENCH, materials=[material(elastic=elastic, mohr_coulomb=None, tension=None)])
    grid = build_grid(scene)
    model = build_model(scene, grid)
    if shake:
        free = ~model.fixed.any(axis=1)
        xy = grid.xy + shake * free[:, None] * np.random.default_rng(1).uniform(-1, 1, grid.xy.shape)
        model = build_model(scene, grid._replace(xy=xy))
    return model


def stiffness(model):
    """K (2N, 2N) [N/m] by unit displacements."""
    dofs = 2 * len(model.grid.xy)
    K = np.empty((dofs, dofs))
    for k in range(dofs):
        state = new_state(model)
        state.velocity.ravel()[k] = 1.0
        advance(model, state)
        K[:, k] = -state.force.ravel()
    return K


def highest(model, extra=None):
    """Largest omega^2 at a step of 1 of the assembled operator, by the kernels; extra: springs (N,) [N/m] to the ground."""
    K, mass = stiffness(model), np.repeat(model.mass, 2)
    if extra is not None:
        K[np.diag_indices_from(K)] += np.repeat(extra, 2)
        mass = mass + np.repeat(0.5 * extra, 2)  # what the discs ask for: half the stiffness at a step of 1
    return np.linalg.eigvalsh(K / np.sqrt(mass[:, None] * mass)).max()
