"""Energies of the discs, for histories and for the continuum's monitor.

Kinetic: sum m v^2 / 2 + I w^2 / 2 with the masses of the motion (scaled ones in static mode). Stored in contact springs:
sum Fn^2 / 2 kn + Fs^2 / 2 ks, in rolling springs Mr^2 / 2 kr, in parallel bonds Fn^2 / 2 kn'A + Fs^2 / 2 ks'A + M^2 / 2 kn'J.
"""

from coupler_protocol.compiled.jit import jit
from dem_server.effects.bond import BONDED
from dem_server.model import FX, FY, INERTIA, MASS, MOMENT, RADIUS, SPIN, VX, VY, Y
from dem_server.step import walls
from dem_server.step.compiled_laws import bending_stiffness, bond_radius, effective_radius, rolling_stiffness


@jit
def kinetic_kernel(disc, clumps, first):
    """Kinetic energy [J] of discs `first`..n-1 and clumps."""
    total = 0.0
    for i in range(first, disc.shape[0]):
        if clumps is not None:  # noqa: SIM102 (numba prunes this line only if it stands alone)
            if clumps.body[i] >= 0:
                continue
        total += disc[i, MASS] * (disc[i, VX] ** 2 + disc[i, VY] ** 2) + disc[i, INERTIA] * disc[i, SPIN] ** 2
    if clumps is not None:
        body = clumps.motion
        for c in range(len(body)):
            total += body[c, MASS] * (body[c, VX] ** 2 + body[c, VY] ** 2) + body[c, INERTIA] * body[c, SPIN] ** 2
    return 0.5 * total


@jit
def stored_kernel(disc, first, second, kind, normal, shear, rolled, parallel, spring, parallel_bond):
    """Elastic energy [J] of all contacts; a pair without contact has no force."""
    total = 0.0
    for p in range(len(first)):
        k, ri, rj = kind[p], disc[first[p], RADIUS], disc[second[p], RADIUS]
        total += normal[p] ** 2 / spring.normal[k]
        if shear is not None:
            total += over(shear[p] ** 2, spring.shear[k])
        if rolled is not None:
            total += over(rolled[p] ** 2, rolling_stiffness(spring.shear[k], effective_radius(ri, rj)))
        if parallel is not None:  # noqa: SIM102 (numba prunes this line only if it stands alone)
            if parallel.state[p] == BONDED:
                R = bond_radius(parallel_bond.radius[k], min(ri, rj))
                total += parallel.normal[p] ** 2 / (2.0 * R * parallel_bond.normal[k])
                total += over(parallel.shear[p] ** 2, 2.0 * R * parallel_bond.shear[k])
                total += parallel.moment[p] ** 2 / bending_stiffness(parallel_bond.normal[k], R)
    return 0.5 * total


@jit
def over(square, stiffness):
    """Square of a force over the stiffness of its spring; 0 without a spring."""
    return square / stiffness if stiffness > 0.0 else 0.0


@jit
def ring_power(carried, disc):
    """Power [W] of forces and moments (R,3) on the control discs, the first R of `disc`, in their present velocities."""
    total = 0.0
    for p in range(len(carried)):
        total += carried[p, FX] * disc[p, VX] + carried[p, FY] * disc[p, VY] + carried[p, MOMENT] * disc[p, SPIN]
    return total


def kinetic(model, state):
    """Kinetic energy of the free discs and clumps [J]."""
    return kinetic_kernel(state.disc, state.clumps, model.ring)


def stored(model, state):
    """Elastic energy of all contacts [J]."""
    law = model.law
    total = stored_kernel(
        state.disc, state.first, state.second, state.kind, state.normal, state.shear, state.rolled, state.parallel,
        law.spring, law.parallel_bond,
    )  # fmt: skip
    return total if state.walls is None else total + walls.stored(model, state)


@jit
def weight_of_clump(c, clumps, weight):
    """Mass [kg] of clump c that gravity acts on, at its centroid."""
    total = 0.0
    for q in range(clumps.start[c], clumps.start[c + 1]):
        total += weight[clumps.member[q]]
    return total


@jit
def weight_height_kernel(disc, weight, clumps, first):
    """Kernel of `weight_height`."""
    total = 0.0
    for i in range(first, disc.shape[0]):
        if clumps is not None:  # noqa: SIM102 (numba prunes this line only if it stands alone)
            if clumps.body[i] >= 0:
                continue
        total += weight[i] * disc[i, Y]
    if clumps is not None:
        for c in range(len(clumps.motion)):
            total += weight_of_clump(c, clumps, weight) * clumps.motion[c, Y]
    return total


def weight_height(model, state):
    """Sum [kg m] over the free discs and clumps of the mass that gravity acts on times y; of a clump, that of its centroid."""
    return weight_height_kernel(state.disc, state.weight, state.clumps, model.ring)


def potential(state, gravity):
    """Energy of the weight of all discs and clumps above y = 0 under `gravity` [m/s2] (J)."""
    if state.clumps is not None:
        return gravity * weight_height_kernel(state.disc, state.weight, state.clumps, 0)
    return gravity * float(state.weight @ state.x[:, 1])
