"""Energy that the springs of the listed pairs lose in a step: their work minus the change of their stored energy.

Eq (1) of energy_ledger.py for each pair, with the motions of contact_law.py: change of the gap, slip, relative turn. Runs only
with `record.energy`.

Dashpots add D = (Dn, Ds) to the forces of springs (effects/dashpot.py: limits in tension and slip included), and lose in a step

    -(D + D')/2 . w          w: change of the gap, slip

D' is that of the velocities of the step. D, of the step before, is computed once more from what contacts had then.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coupler_protocol.compiled.jit import jit
from dem_server.effects.bond import BONDED
from dem_server.model import RADIUS, SPIN, VX, VY, X, Y
from dem_server.step.compiled_laws import (
    bending_stiffness,
    bond_radius,
    clipped,
    effective_radius,
    rolling_stiffness,
    slip_limit,
    viscous_force,
)
from dem_server.step.contact_law import NOWHERE


@jit
def lost(k, before, after, way):
    """Loss [J] by Eq (1): forces [N] `before` and `after` the displacement `way` [m] (or moments, turn); 0 without a spring."""
    return -0.5 * (before + after) * (way + (after - before) / k) if k > 0.0 else 0.0


@jit
def ways(i, j, disc, dt):
    """Change of the gap [m], slip [m] and relative turn [rad] of discs i and j in the step that ends."""
    dx, dy = disc[j, X] - disc[i, X], disc[j, Y] - disc[i, Y]
    du, dv = (disc[j, VX] - disc[i, VX]) * dt, (disc[j, VY] - disc[i, VY]) * dt
    d = sqrt(dx * dx + dy * dy)
    inv = 1.0 / max(d, NOWHERE)
    nx, ny = dx * inv, dy * inv
    vn, vt = du * nx + dv * ny, dv * nx - du * ny
    lever = 0.5 * (d - disc[i, RADIUS] - disc[j, RADIUS])
    a, b = 0.5 * vn * inv, 0.125 * (vt * inv) * (vt * inv)
    slip = (
        vt * (1.0 + a + a * a - b) - (disc[i, SPIN] * (disc[i, RADIUS] + lever) + disc[j, SPIN] * (disc[j, RADIUS] + lever)) * dt
    )
    before2 = (dx - du) * (dx - du) + (dy - dv) * (dy - dv)
    stretch = (du * (2.0 * dx - du) + dv * (2.0 * dy - dv)) / max(d + sqrt(before2), NOWHERE)  # d - before, without cancellation
    return stretch, slip, (disc[j, SPIN] - disc[i, SPIN]) * dt


@jit
def lost_of(p, k, before, after, way):
    """`lost` of pair p with arrays of forces; 0 if the effect is absent."""
    if after is None:
        return 0.0
    return lost(k, before[p], after[p], way)


@jit
def breaks_now(p, before, after):
    """Whether the contact bond of pair p breaks in the step."""
    if after is None:
        return False
    return after[p] != before[p]


@jit
def lost_with_parallel_bond(p, k, smaller, ways_of_pair, before, after, parallel_bond):
    """Energy [J] lost with the parallel bond of pair p, if the bond breaks in the step."""
    total = 0.0
    if after is not None:  # noqa: SIM102 (numba prunes this line only if it stands alone)
        if before.state[p] == BONDED and after.state[p] != BONDED:
            stretch, slip, turn = ways_of_pair
            R = bond_radius(parallel_bond.radius[k], smaller)
            total += lost(2.0 * R * parallel_bond.normal[k], before.normal[p], after.normal[p], stretch)
            total += lost(2.0 * R * parallel_bond.shear[k], before.shear[p], after.shear[p], slip)
            total += lost(bending_stiffness(parallel_bond.normal[k], R), before.moment[p], after.moment[p], turn)
    return total


@jit
def copy_of(array, copy):
    """Copies the history of an effect, if it is there."""
    if array is not None:
        for p in range(len(array)):
            copy[p] = array[p]


@jit
def copy_springs(history, before):
    """Copies what `pair_losses` reads of a PairHistory to another one of the same list."""
    copy_of(history.normal, before.normal)
    copy_of(history.shear, before.shear)
    copy_of(history.rolled, before.rolled)
    copy_of(history.bond_state, before.bond_state)
    copy_of(history.root_mass, before.root_mass)
    copy_of_parallel_bonds(history.parallel, before.parallel)


@jit
def copy_of_parallel_bonds(bonds, before):
    """Copies what `lost_with_parallel_bond` reads, if there are parallel bonds."""
    if bonds is not None:
        copy_of(bonds.state, before.state)
        copy_of(bonds.normal, before.normal)
        copy_of(bonds.shear, before.shear)
        copy_of(bonds.moment, before.moment)


@jit
def pair_losses(disc, listed, dt, before, after, spring, parallel_bond):
    """Losses [J] of all pairs in a step between the PairHistory `before` and `after`: by slip and rolling, by broken bonds."""
    friction = bonds = 0.0
    for p in range(len(listed.first)):
        i, j, k = listed.first[p], listed.second[p], listed.kind[p]
        ri, rj = disc[i, RADIUS], disc[j, RADIUS]
        stretch, slip, turn = ways(i, j, disc, dt)
        tangential = lost_of(p, spring.shear[k], before.shear, after.shear, slip)
        kr = rolling_stiffness(spring.shear[k], effective_radius(ri, rj))
        tangential += lost_of(p, kr, before.rolled, after.rolled, turn)
        if breaks_now(p, before.bond_state, after.bond_state):
            bonds += tangential + lost(spring.normal[k], before.normal[p], after.normal[p], stretch)
        else:
            friction += tangential
        bonds += lost_with_parallel_bond(p, k, min(ri, rj), (stretch, slip, turn), before.parallel, after.parallel, parallel_bond)
    return friction, bonds


class Viscous(NamedTuple):
    """Dashpots by kind of pair (kinds,): of `DashpotTable`; friction coefficient, None without friction."""

    normal: NDArray[np.float64]
    shear: NDArray[np.float64]
    tension: NDArray[np.bool_]
    friction: NDArray[np.float64] | None


def viscous_of(law):
    """The Viscous of a Law; None without dashpots."""
    if law.dashpot is None:
        return None
    return Viscous(*law.dashpot, None if law.friction is None else law.friction.coefficient)


@jit
def dashpot_losses(disc, listed, dt, old, kick, before, after, viscous):
    """Loss [J] in the dashpots of all pairs in a step; old (n,3): velocities and spins before it, extrapolated if kick != dt."""
    total, back = 0.0, kick / dt
    if viscous is not None:
        for p in range(len(listed.first)):
            i, j, k = listed.first[p], listed.second[p], listed.kind[p]
            ri, rj = disc[i, RADIUS], disc[j, RADIUS]
            dx, dy = disc[j, X] - disc[i, X], disc[j, Y] - disc[i, Y]
            du, dv, wi, wj = disc[j, VX] - disc[i, VX], disc[j, VY] - disc[i, VY], disc[i, SPIN], disc[j, SPIN]
            stretch, slip, _ = ways(i, j, disc, dt)
            Dn, Ds = extra_force(p, k, rates(dx, dy, du, dv, wi, wj, ri, rj), after, viscous)
            dx, dy = dx - du * dt, dy - dv * dt
            du, dv = du - (du - (old[j, 0] - old[i, 0])) * back, dv - (dv - (old[j, 1] - old[i, 1])) * back
            wi, wj = wi - (wi - old[i, 2]) * back, wj - (wj - old[j, 2]) * back
            En, Es = extra_force(p, k, rates(dx, dy, du, dv, wi, wj, ri, rj), before, viscous)
            total -= 0.5 * ((Dn + En) * stretch + (Ds + Es) * slip)
    return total


@jit
def rates(dx, dy, du, dv, wi, wj, ri, rj):
    """(gap [m], its rate, rate of slip [m/s]) of two discs at a distance (dx, dy) with a relative velocity (du, dv)."""
    d = sqrt(dx * dx + dy * dy)
    inv = 1.0 / max(d, NOWHERE)
    nx, ny, half = dx * inv, dy * inv, 0.5 * (d - ri - rj)
    return d - ri - rj, du * nx + dv * ny, dv * nx - du * ny - wi * (ri + half) - wj * (rj + half)


@jit
def extra_force(p, k, motion, history, viscous):
    """(Dn, Ds) [N]: what the dashpots of pair p add to its springs; motion: of `rates`."""
    gap, rate, slip_rate = motion
    Fn, Fs, root = history.normal[p], history.shear[p], history.root_mass[p]
    Dn = Fn + viscous_force(viscous.normal[k], root, rate)
    Ds = Fs + viscous_force(viscous.shear[k], root, slip_rate)
    if holds(p, history.bond_state):
        return Dn - Fn, Ds - Fs
    if gap - value_at(p, history.reference_gap) < 0.0:
        limit = slip_limit(value_at(k, viscous.friction), Fn)
        return (Dn if viscous.tension[k] else max(Dn, 0.0)) - Fn, clipped(Ds, limit) - Fs
    return 0.0, 0.0


@jit
def holds(p, bond_state):
    """Whether the contact bond of pair p holds; False without contact bonds."""
    if bond_state is None:
        return False
    return bond_state[p] == BONDED


@jit
def value_at(p, values):
    """A value of an array; 0 without the array."""
    if values is None:
        return 0.0
    return values[p]
