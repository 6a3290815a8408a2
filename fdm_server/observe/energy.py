"""Energies of the grid, computed from the state on demand."""

import numpy as np

from fdm_server.step import present_shape
from fdm_server.step.blocks import from_blocks, triangle_double_areas


def strain_energy(model, state):
    """Elastic energy [J] stored in the zones by the in-plane and out-of-plane stresses.

        area p^2/2K + (sm - zz)^2/6G + sum over the triangles of their share (sd^2 + xy^2)/2G,   p = (2 sm + zz)/3

    In mixed discretisation sm and zz belong to the zone, sd and xy to its triangles.
    """
    rows = from_blocks(state.stress, len(model.zone))
    double = triangle_double_areas(present_shape.present(model, state), model.zones)
    area = 0.5 * (double[:, 0] + double[:, 1])
    elastic = model.material_law.elastic[model.grid.material[model.zone]]
    G, K = elastic[:, 1], elastic[:, 0] - elastic[:, 1] / 3.0
    sm, zz = rows[:, 0], rows[:, 1]
    whole = area * ((2.0 * sm + zz) ** 2 / (18.0 * K) + (sm - zz) ** 2 / (6.0 * G))
    parts = 0.25 * double * (rows[:, 2:6] ** 2 + rows[:, 6:10] ** 2) / (2.0 * G)[:, None]
    return float(np.sum(whole) + np.sum(parts))
