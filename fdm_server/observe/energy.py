"""Energies of the grid, computed from the state on demand."""

import numpy as np

from coupler_protocol.compiled.jit import jit
from fdm_server.step import present_shape
from fdm_server.step.blocks import LANES
from fdm_server.step.large_strain import double_areas
from fdm_server.step.stress import SD, SM, XY, ZZ


@jit
def strain_kernel(geometry, stiffness, stress, displacement, xy):
    """Kernel of `strain_energy`; geometry, stiffness, xy: as for fdm_server.step.zone_pass.zones_kernel.

    Sums of zones and blocks are added: one long sum would round too much for a ledger that closes to round-off.
    """
    corner, x, y, _, _ = geometry
    pattern, elastic = stiffness
    at_x, at_y = np.empty((1, 4 * LANES)), np.empty((1, 4 * LANES))
    total = 0.0
    for b in range(corner.shape[0]):
        for k in range(4 * LANES):
            at_x[0, k], at_y[0, k] = x[b, k], y[b, k]
            if xy is not None:
                n = corner[b, k]
                at_x[0, k], at_y[0, k] = xy[n, 0] + displacement[n, 0], xy[n, 1] + displacement[n, 1]
        m, of_block = pattern[b], 0.0
        for i in range(LANES):
            double = double_areas(at_x, at_y, i)
            G = elastic[m, LANES + i]
            K = elastic[m, i] - G / 3.0
            sm, zz = stress[b, SM + i], stress[b, ZZ + i]
            area = 0.5 * (double[0] + double[1])
            of_zone = area * ((2.0 * sm + zz) ** 2 / (18.0 * K) + (sm - zz) ** 2 / (6.0 * G))
            for t in range(4):
                sd, tau = stress[b, SD + t * LANES + i], stress[b, XY + t * LANES + i]
                of_zone += 0.25 * double[t] * (sd**2 + tau**2) / (2.0 * G)
            of_block += of_zone
        total += of_block
    return total


def strain_energy(model, state):
    """Elastic energy [J] stored in the zones by the in-plane and out-of-plane stresses.

        area p^2/2K + (sm - zz)^2/6G + sum over the triangles of their share (sd^2 + xy^2)/2G,   p = (2 sm + zz)/3

    In mixed discretisation sm and zz belong to the zone, sd and xy to its triangles.
    """
    stiffness, xy = (model.pattern, model.law.elastic), present_shape.moving(model, state)
    return strain_kernel(tuple(model.geometry), stiffness, state.stress, state.displacement, xy)
