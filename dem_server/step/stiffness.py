"""Sums of stiffness and of dashpots over the listed pairs of every body.

    kn = spring + bond,   ks = spring + bond,   kr = rolling spring + bending of the bond
    disc:   sum kn nx^2 + ks ny^2,  sum kn ny^2 + ks nx^2,  sum ks r^2 + kr             (1)
    clump:  largest eigenvalue of sum kn n n^T + ks t t^T,  sum kn an^2 + ks at^2 + kr  (2)
    both:   sum max(cn, 2 cs)  and  sum 2 cs l^2                                        (3)

an, at: levers of normal and tangent about the clump's centroid; l: radius of the disc or lever of the contact. A pair
without contact counts as if it touched; a parallel bond counts only if it exists.
"""

from typing import NamedTuple

import numpy as np

from coupler_protocol.compiled.jit import jit
from dem_server.effects.bond import BONDED
from dem_server.effects.pair_stiffness import pair_dashpots, pair_stiffness
from dem_server.effects.rolling import effective_radius
from dem_server.model import MASS, RADIUS, X, Y
from dem_server.step.compiled_laws import dashpots_of_pair, stiffness_of_pair
from dem_server.step.compiled_laws import effective_radius as reduced_radius
from dem_server.step.contact_law import NOWHERE
from dem_server.step.walls import add_to_sums

REACH = 0.6  # of the smallest radius: distance within which walls count; discs and walls both move before the next sum


class Sums(NamedTuple):
    """Eqs (1) to (3): `discs` (n, 3), `disc_dashpots` (n, 2); `clumps` (c, 2), `clump_dashpots` (c, 2); None: there are none."""

    discs: np.ndarray
    disc_dashpots: np.ndarray | None
    clumps: np.ndarray | None
    clump_dashpots: np.ndarray | None


def sums(model, state, pair_masses=True):
    """Sums over the listed pairs; `pair_masses` False leaves the root of the pair's mass out of cn and cs."""
    law, clumps = model.law, state.clumps
    count = 0 if clumps is None else len(clumps.motion)
    discs, viscous = np.zeros((model.count, 3)), None if law.dashpot is None else np.zeros((model.count, 2))
    matrix = None if clumps is None else np.zeros((count, 4))
    clump_viscous = None if clumps is None or law.dashpot is None else np.zeros((count, 2))
    add_up(
        discs, viscous, matrix, clump_viscous, state.disc, state.first, state.second, state.kind, clumps,
        law.spring, law.rolling, law.parallel_bond, state.parallel, law.dashpot, state.root_mass if pair_masses else None,
    )  # fmt: skip
    found = Sums(discs, viscous, None if clumps is None else eigenvalues(matrix), clump_viscous)
    if state.walls is not None:
        add_to_sums(model, state, found, REACH * model.smallest_radius, pair_masses)
    return found


def set_pair_masses(model, state):
    """Sets the root of mi mj / (mi + mj) of every listed pair, for dashpots; the mass of a held disc is infinite."""
    if state.root_mass is not None:
        pair_masses(state.disc, state.first, state.second, state.clumps, model.ring, state.root_mass)


def pair_stiffnesses(model, state, pairs):
    """kn + 2 cn / dt, ks + 2 cs / dt [N/m] and kr [N m] of listed pairs (m,), dt the next step.

    If no effect carries a shear force, ks is 0; the rolling spring acts all the same, with the shear stiffness of the scene.
    """
    law, kind, slot = model.law, pairs.kind, pairs.slot
    ri, rj = state.radius[pairs.disc_a], state.radius[pairs.disc_b]
    bonded = 0.0 if state.parallel is None else state.parallel.state[slot] == BONDED
    size = effective_radius(ri, rj), np.minimum(ri, rj)
    kn, ks, kr = pair_stiffness(kind, *size, bonded, law.spring, law.rolling, law.parallel_bond)
    if not law.has_shear:
        ks = np.zeros(len(kind))
    if law.dashpot is not None:
        cn, cs = pair_dashpots(kind, 2.0 / state.next_dt * state.root_mass[slot], law.dashpot)
        kn, ks = kn + cn, ks + cs
    return kn, ks, np.zeros(len(kind)) + kr


@jit
def add_up(
    stiff, viscous, matrix, clump_viscous, disc, first, second, kind, clumps,
    spring, rolling, parallel_bond, parallel, dashpot, root_mass,
):  # fmt: skip
    """Kernel of `sums`; matrix (c, 4): xx, yy, xy of Eq (2) and the sum of the rotation."""
    for p in range(len(first)):
        i, j, k = first[p], second[p], kind[p]
        dx, dy = disc[j, X] - disc[i, X], disc[j, Y] - disc[i, Y]
        d = max((dx * dx + dy * dy) ** 0.5, NOWHERE)
        nx, ny = dx / d, dy / d
        nx2 = nx * nx
        bonded = False
        if parallel is not None:
            bonded = parallel.state[p] == BONDED
        ri, rj = disc[i, RADIUS], disc[j, RADIUS]
        kn, ks, kr = stiffness_of_pair(k, reduced_radius(ri, rj), min(ri, rj), bonded, spring, rolling, parallel_bond)
        cn = cs = 0.0
        if dashpot is not None:
            root = 1.0
            if root_mass is not None:
                root = root_mass[p]
            cn, cs = dashpots_of_pair(k, root, dashpot)
            cs *= 2.0
        for a in (i, j):
            stiff[a, 0] += kn * nx2 + ks * (1.0 - nx2)
            stiff[a, 1] += kn * (1.0 - nx2) + ks * nx2
            stiff[a, 2] += ks * disc[a, RADIUS] ** 2 + kr
            if viscous is not None:
                viscous[a, 0] += max(cn, cs)
                viscous[a, 1] += cs * disc[a, RADIUS] ** 2
        if clumps is None:
            continue
        arm = 0.5 * (d + disc[i, RADIUS] - disc[j, RADIUS])
        x, y = disc[i, X] + arm * nx, disc[i, Y] + arm * ny
        for a in (i, j):
            c = clumps.body[a]
            if c < 0:
                continue
            lx, ly = x - clumps.motion[c, X], y - clumps.motion[c, Y]
            matrix[c, 0] += kn * nx * nx + ks * ny * ny
            matrix[c, 1] += kn * ny * ny + ks * nx * nx
            matrix[c, 2] += (kn - ks) * nx * ny
            matrix[c, 3] += kn * (lx * ny - ly * nx) ** 2 + ks * (lx * nx + ly * ny) ** 2 + kr
            if clump_viscous is not None:
                clump_viscous[c, 0] += max(cn, cs)
                clump_viscous[c, 1] += max(cn, cs) * (lx * lx + ly * ly)


@jit
def eigenvalues(matrix):
    """Eq (2) (c, 2) from the sums xx, yy, xy and of the rotation (c, 4)."""
    found = np.empty((len(matrix), 2))
    for c in range(len(matrix)):
        xx, yy, xy = matrix[c, 0], matrix[c, 1], matrix[c, 2]
        found[c, 0] = 0.5 * (xx + yy) + (0.25 * (xx - yy) ** 2 + xy * xy) ** 0.5
        found[c, 1] = matrix[c, 3]
    return found


@jit
def pair_masses(disc, first, second, clumps, ring, root_mass):
    """Kernel of `set_pair_masses`."""
    for p in range(len(first)):
        inverse = 0.0
        for a in (first[p], second[p]):
            if a < ring:
                continue
            mass = disc[a, MASS]
            if clumps is not None:  # noqa: SIM102 (numba prunes this line only if it stands alone)
                if clumps.body[a] >= 0:
                    mass = clumps.motion[clumps.body[a], MASS]
            inverse += 1.0 / mass
        root_mass[p] = inverse**-0.5
