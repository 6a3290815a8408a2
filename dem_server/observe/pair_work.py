"""What the springs of the listed pairs lose in a step: the part of their work that their energy does not explain.

Eq (1) of ledger.py, pair by pair, with the ways of contact_law.py: change of the gap, slip, relative turn. A part of the recorder
`record.energy`; nothing here runs without it.
"""

from math import sqrt

from coupler_protocol.compiled.jit import jit
from dem_server.effects.bond import BONDED
from dem_server.step.compiled_laws import bending_stiffness, bond_radius, effective_radius, rolling_stiffness
from dem_server.step.contact_law import NOWHERE


@jit
def lost(k, before, after, way):
    """Eq (1) [J]: forces [N] `before` and `after` the `way` [m] (or moments and turn); no spring, no energy."""
    return -0.5 * (before + after) * (way + (after - before) / k) if k > 0.0 else 0.0


@jit
def ways(i, j, disc, dt):
    """Change of the gap [m], slip [m] and relative turn [rad] of discs i and j in the step that ends."""
    dx, dy = disc[j, 0] - disc[i, 0], disc[j, 1] - disc[i, 1]
    du, dv = (disc[j, 2] - disc[i, 2]) * dt, (disc[j, 3] - disc[i, 3]) * dt
    d = sqrt(dx * dx + dy * dy)
    inv = 1.0 / max(d, NOWHERE)
    nx, ny = dx * inv, dy * inv
    vn, vt = du * nx + dv * ny, dv * nx - du * ny
    lever = 0.5 * (d - disc[i, 5] - disc[j, 5])
    a, b = 0.5 * vn * inv, 0.125 * (vt * inv) * (vt * inv)
    slip = vt * (1.0 + a + a * a - b) - (disc[i, 4] * (disc[i, 5] + lever) + disc[j, 4] * (disc[j, 5] + lever)) * dt
    before2 = (dx - du) * (dx - du) + (dy - dv) * (dy - dv)
    stretch = (du * (2.0 * dx - du) + dv * (2.0 * dy - dv)) / max(d + sqrt(before2), NOWHERE)  # d - before, without cancellation
    return stretch, slip, (disc[j, 4] - disc[i, 4]) * dt


@jit
def pair_losses(
    disc, first, second, kind, dt, normal, shear, rolled, bond_state, glued, glue_normal, glue_shear, glue_moment,
    normal0, shear0, rolled0, bonded0, glued0, glue_normal0, glue_shear0, glue_moment0, spring, parallel_bond,
):  # fmt: skip
    """Losses [J] of all pairs in a step: of slip and rolling, and of pairs whose bond broke; names with 0: before the step."""
    friction = bonds = 0.0
    for p in range(len(first)):
        k, ri, rj = kind[p], disc[first[p], 5], disc[second[p], 5]
        stretch, slip, turn = ways(first[p], second[p], disc, dt)
        tangential, breaks = 0.0, False
        if shear is not None:
            tangential += lost(spring.shear[k], shear0[p], shear[p], slip)
        if rolled is not None:
            tangential += lost(rolling_stiffness(spring.shear[k], effective_radius(ri, rj)), rolled0[p], rolled[p], turn)
        if bond_state is not None:
            breaks = bond_state[p] != bonded0[p]
        if breaks:
            bonds += tangential + lost(spring.normal[k], normal0[p], normal[p], stretch)
        else:
            friction += tangential
        if glued is not None:  # noqa: SIM102 (numba prunes this line only if it stands alone)
            if glued0[p] == BONDED and glued[p] != BONDED:
                R = bond_radius(parallel_bond.radius[k], min(ri, rj))
                bonds += lost(2.0 * R * parallel_bond.normal[k], glue_normal0[p], glue_normal[p], stretch)
                bonds += lost(2.0 * R * parallel_bond.shear[k], glue_shear0[p], glue_shear[p], slip)
                bonds += lost(bending_stiffness(parallel_bond.normal[k], R), glue_moment0[p], glue_moment[p], turn)
    return friction, bonds
