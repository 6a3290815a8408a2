"""What hangs on every body: sums of stiffness and of dashpots over its listed pairs.

    kn = spring + bond,   ks = spring + bond,   kr = rolling spring + bending of the bond
    disc:   sum kn nx^2 + ks ny^2,  sum kn ny^2 + ks nx^2,  sum ks r^2 + kr             (1)
    clump:  largest eigenvalue of sum kn n n^T + ks t t^T,  sum kn an^2 + ks at^2 + kr  (2)
    both:   sum max(cn, 2 cs)  and  sum 2 cs l^2                                        (3)

an, at: levers of normal and tangent about the clump's centroid; l: radius of the disc or lever of the contact. A pair
that does not touch counts as if it did; a parallel bond counts only where there is one.
"""

import numpy as np

from coupler_protocol.jit import jit
from dem_server.effects import parallel_bond as parallel_law
from dem_server.effects import rolling as rolling_law
from dem_server.effects.bond import BONDED

effective_radius = jit(rolling_law.effective_radius)
rolling_stiffness = jit(rolling_law.rolling_stiffness)
bond_radius = jit(parallel_law.bond_radius)
bending_stiffness = jit(parallel_law.bending_stiffness)


def sums(model, state, dashpots="with their masses"):
    """Eqs (1) and (3) of every disc: stiffness (n, 3) and dashpots (n, 2) or None.

    dashpots: "without masses" leaves the root of the pair's mass out of cn and cs.
    """
    stiff, viscous = np.zeros((model.count, 3)), _room(model, model.count)
    disc_sums(stiff, viscous, *_pairs(model, state, dashpots))
    return stiff, viscous


def sums_of_clumps(model, state, dashpots="with their masses"):
    """Eqs (2) and (3) of every clump: stiffness (c, 2) and dashpots (c, 2) or None; `dashpots` as in `sums`."""
    count = len(state.clumps.motion)
    stiff, viscous = np.zeros((count, 2)), _room(model, count)
    clump_sums(stiff, viscous, state.clumps, *_pairs(model, state, dashpots))
    return stiff, viscous


def set_pair_masses(model, state):
    """Root of mi mj / (mi + mj) of every listed pair, for dashpots; mass of a held disc: infinite."""
    if state.root_mass is not None:
        pair_masses(state.disc, state.used, state.partner, state.clumps, model.ring, state.root_mass)


def contact_stiffnesses(model, state, pairs):
    """Larger of kn + 2 cn and ks + 2 cs of listed pairs (m,) [N/m] (static mode, dt = 1)."""
    law, kind, slot = model.law, pairs.kind, pairs.slot
    normal, shear = law.spring.normal[kind], law.spring.shear[kind]
    if law.parallel_bond is not None:
        bonded = state.parallel.state.ravel()[slot] == BONDED
        smaller = np.minimum(state.radius[pairs.disc_a], state.radius[pairs.disc_b])
        width = 2.0 * bonded * law.parallel_bond.radius[kind] * smaller
        normal, shear = normal + width * law.parallel_bond.normal[kind], shear + width * law.parallel_bond.shear[kind]
    if law.dashpot is not None:
        root = 2.0 * state.root_mass.ravel()[slot]
        normal, shear = normal + root * law.dashpot.normal[kind], shear + root * law.dashpot.shear[kind]
    return np.maximum(normal, shear)


def _room(model, count):
    return None if model.law.dashpot is None else np.zeros((count, 2))


def _pairs(model, state, dashpots):
    law = model.law
    root_mass = None if dashpots == "without masses" else state.root_mass
    return (
        state.disc, state.used, state.partner, state.kind, law.spring, law.rolling, law.parallel_bond, state.parallel,
        law.dashpot, root_mass,
    )  # fmt: skip


@jit
def contact_stiffness(k, ri, rj, i, s, spring, rolling, parallel_bond, parallel):
    """kn, ks [N/m], kr [N m] of slot `s` of disc `i`, whose pair is of kind `k`."""
    kn, ks, kr = spring.normal[k], spring.shear[k], 0.0
    if rolling is not None:
        kr += rolling_stiffness(ks, effective_radius(ri, rj))
    if parallel_bond is not None:  # noqa: SIM102 (numba prunes this line only if it stands alone)
        if parallel.state[i, s] == BONDED:
            R = bond_radius(parallel_bond.radius[k], ri, rj)
            kn += 2.0 * R * parallel_bond.normal[k]
            ks += 2.0 * R * parallel_bond.shear[k]
            kr += bending_stiffness(parallel_bond.normal[k], R)
    return kn, ks, kr


@jit
def disc_sums(
    stiff, viscous, disc, used, partner, kind, spring, rolling, parallel_bond, parallel, dashpot, root_mass
):
    """Kernel of `sums`."""
    for i in range(len(used)):
        for s in range(used[i]):
            j, k = partner[i, s], kind[i, s]
            dx, dy = disc[j, 0] - disc[i, 0], disc[j, 1] - disc[i, 1]
            nx2 = dx * dx / (dx * dx + dy * dy)
            kn, ks, kr = contact_stiffness(k, disc[i, 5], disc[j, 5], i, s, spring, rolling, parallel_bond, parallel)
            for a in (i, np.int64(j)):
                stiff[a, 0] += kn * nx2 + ks * (1.0 - nx2)
                stiff[a, 1] += kn * (1.0 - nx2) + ks * nx2
                stiff[a, 2] += ks * disc[a, 5] ** 2 + kr
                if dashpot is not None:
                    root = 1.0
                    if root_mass is not None:
                        root = root_mass[i, s]
                    viscous[a, 0] += root * max(dashpot.normal[k], 2.0 * dashpot.shear[k])
                    viscous[a, 1] += root * 2.0 * dashpot.shear[k] * disc[a, 5] ** 2


@jit
def clump_sums(
    stiff, viscous, clumps, disc, used, partner, kind, spring, rolling, parallel_bond, parallel, dashpot, root_mass
):
    """Kernel of `sums_of_clumps`."""
    xy = np.zeros(len(stiff))  # the mixed term of the matrix in Eq (2); xx and yy stand in `matrix`
    matrix = np.zeros((len(stiff), 2))
    for i in range(len(used)):
        for s in range(used[i]):
            j, k = partner[i, s], kind[i, s]
            dx, dy = disc[j, 0] - disc[i, 0], disc[j, 1] - disc[i, 1]
            d = (dx * dx + dy * dy) ** 0.5
            nx, ny = dx / d, dy / d
            arm = 0.5 * (d + disc[i, 5] - disc[j, 5])
            px, py = disc[i, 0] + arm * nx, disc[i, 1] + arm * ny
            kn, ks, kr = contact_stiffness(k, disc[i, 5], disc[j, 5], i, s, spring, rolling, parallel_bond, parallel)
            for a in (i, np.int64(j)):
                c = clumps.body[a]
                if c < 0:
                    continue
                lx, ly = px - clumps.motion[c, 0], py - clumps.motion[c, 1]
                an, at = lx * ny - ly * nx, lx * nx + ly * ny
                matrix[c, 0] += kn * nx * nx + ks * ny * ny
                matrix[c, 1] += kn * ny * ny + ks * nx * nx
                xy[c] += (kn - ks) * nx * ny
                stiff[c, 1] += kn * an**2 + ks * at**2 + kr
                if dashpot is not None:
                    root = 1.0
                    if root_mass is not None:
                        root = root_mass[i, s]
                    cn, cs = root * dashpot.normal[k], root * 2.0 * dashpot.shear[k]
                    viscous[c, 0] += max(cn, cs)
                    viscous[c, 1] += max(cn, cs) * (lx * lx + ly * ly)
    for c in range(len(stiff)):
        xx, yy = matrix[c, 0], matrix[c, 1]
        stiff[c, 0] = 0.5 * (xx + yy) + (0.25 * (xx - yy) ** 2 + xy[c] * xy[c]) ** 0.5


@jit
def pair_masses(disc, used, partner, clumps, ring, root_mass):
    """Kernel of `set_pair_masses`."""
    for i in range(len(used)):
        for s in range(used[i]):
            inverse = 0.0
            for a in (i, np.int64(partner[i, s])):
                if a < ring:
                    continue
                mass = disc[a, 6]
                if clumps is not None:  # noqa: SIM102 (numba prunes this line only if it stands alone)
                    if clumps.body[a] >= 0:
                        mass = clumps.motion[clumps.body[a], 6]
                inverse += 1.0 / mass
            root_mass[i, s] = inverse**-0.5
