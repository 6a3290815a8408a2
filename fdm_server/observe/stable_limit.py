"""Frequencies of the grid: stiffness of zones as the kernels compute it, and the zone with the shortest stable step.

The largest omega^2 of all zones together is at most the largest omega^2 of a single zone with its share of the gridpoints' masses
(Irons & Treharne 1971, A bound theorem in eigenvalues and its practical applications, Proc. 3rd Conf. Matrix Methods in
Structural Mechanics, Wright-Patterson AFB), because u.K u and u.M u are sums over zones. Zones are elastic here, because plastic
flow only softens, and their shape is constant.
"""

import numpy as np
import scipy

from coupler_protocol.compiled.jit import jit
from coupler_protocol.criteria.stable_step import limit
from coupler_protocol.scene.local_origin import in_the_scene
from fdm_server.step.blocks import LANES, build_geometry, from_blocks
from fdm_server.step.forces import CORNER_ROWS, corner_forces
from fdm_server.step.masses import static_masses, weight_masses
from fdm_server.step.present_shape import masses, present
from fdm_server.step.strain import STRAIN_ROWS, strain_increments
from fdm_server.step.stress import STRESS_ROWS, load


@jit
def _respond(row, x, y, inverse_double_area, pattern, elastic, u, strain, stress, force):
    """Computes the forces of all blocks on their corners if row `row` of corner displacements is 1 and all others are 0."""
    u[:] = 0.0
    u[row * LANES : (row + 1) * LANES] = 1.0
    stress[:] = 0.0
    for b in range(x.shape[0]):
        strain_increments(b, x, y, inverse_double_area, u, strain)
        load(b, pattern[b], elastic, strain, stress)
        corner_forces(b, x, y, stress, force)


def zone_stiffness(model, state):
    """Stiffness (A, 8, 8) [N/m] of the active zones in their present shape: rows and columns x at four corners, then y."""
    g, zones = build_geometry(present(model, state), model.zones), len(model.zone)
    u, strain = np.empty(CORNER_ROWS * LANES), np.empty(STRAIN_ROWS * LANES)
    stress, force = np.empty((len(g.x), STRESS_ROWS * LANES)), np.empty((len(g.x), CORNER_ROWS * LANES))
    K = np.empty((zones, 8, 8))
    for row in range(8):
        _respond(row, g.x, g.y, g.inverse_double_area, model.pattern, model.law.elastic, u, strain, stress, force)
        K[:, :, row] = -from_blocks(force, zones)
    return K


def zone_masses(model, state):
    """Shares (A, 4) [kg] of the active zones in the masses of their corners, without the masses of contact springs."""
    xy, zones = present(model, state), model.zones
    apart, own = xy[zones].reshape(-1, 2), np.arange(zones.size).reshape(-1, 4)
    if state.in_real_time:
        share = weight_masses(apart, own, model.zone_density)
    else:
        share = static_masses(apart, own, model.modulus)
    whole = np.bincount(zones.ravel(), share, minlength=len(xy))
    return (share * (masses(model, state) / np.where(whole > 0.0, whole, 1.0))[zones.ravel()]).reshape(-1, 4)


def zone_frequencies(stiffness, mass, zones):
    """Largest omega^2 (A,) of each single zone; stiffness (A, 8, 8), mass (A, 4), zones (A, 4)."""
    first = (zones[:, :, None] == zones[:, None, :]).argmax(axis=2)  # corners of a triangle that are one gridpoint
    merge = np.zeros((len(zones), 8, 8))
    for corner in range(4):
        for axis in (0, 4):
            merge[np.arange(len(zones)), axis + corner, axis + first[:, corner]] = 1.0
    merged = np.einsum("zic,zi->zc", merge, np.tile(mass, (1, 2)))
    scale = np.divide(1.0, np.sqrt(merged), out=np.zeros_like(merged), where=merged > 0.0)
    scaled = np.einsum("zij,zi->zij", merge.transpose(0, 2, 1) @ stiffness @ merge, scale) * scale[:, None, :]
    return np.linalg.eigvalsh(0.5 * (scaled + scaled.transpose(0, 2, 1)))[:, -1]


def stiffness_matrix(model, stiffness):
    """K (2 N, 2 N) [N/m], sparse, of the stiffnesses (A, 8, 8) of the zones; components x, y of each gridpoint in turn."""
    dof = np.concatenate([2 * model.zones, 2 * model.zones + 1], axis=1)
    row, column = np.repeat(dof, 8, axis=1).ravel(), np.tile(dof, (1, 8)).ravel()
    size = 2 * len(model.grid.xy)
    return scipy.sparse.csr_array((stiffness.ravel(), (row, column)), shape=(size, size))


def safe_limits(model, state, nodes=None, sums=None):
    """Limits of the step (coupler_protocol.criteria.stable_step.limit): "grid" by zones, with rims "interface" by their nodes.

    nodes (K,): gridpoints of all rims; sums (K,) [N/m]: of the mass rule of their contact springs (dem_server/coupling/rim.py),
    which bound u.K u of the springs by 2 sums u^2. The mass of a node must be enough for these and for its zones.
    """
    xy, alpha = present(model, state), model.law.damping or model.law.combined or 0.0
    mass = zone_masses(model, state)
    omega2 = zone_frequencies(zone_stiffness(model, state), mass, model.zones)
    worst = int(np.argmax(omega2))
    there = in_the_scene(xy, model.grid.origin)
    found = {"grid": limit(omega2[worst], alpha, state.dt, "zone", there[model.zones[worst]].mean(axis=0))}
    if nodes is not None and len(nodes):
        asked = np.bincount(model.zones.ravel(), (mass * omega2[:, None]).ravel(), minlength=len(xy))[nodes] + 2.0 * sums
        own = asked / (masses(model, state) + state.added_mass)[nodes]
        own[model.fixed[nodes].all(axis=1)] = 0.0
        least = int(np.argmax(own))
        found["interface"] = limit(own[least], alpha, state.dt, "node", there[nodes[least]])
    return found
