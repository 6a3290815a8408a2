"""Contact forces: one pass over the slots, every effect that acts in its place, absent ones compiled away.

Geometry of a contact (2-D, unit thickness), unit vectors n from i to j, t = (-ny, nx):

    g = |xj - xi| - ri - rj,   li = ri + g/2,   lj = rj + g/2                    (1)
    slip = ((vj - vi).t' - wi li - wj lj) dt                                     (2)
    force on j: Fn n + Fs t, on i the opposite;  moments -Fs li, -Fs lj          (3)

t' is the tangent at mid-step, so that a rigid turn of both discs gives no slip up to third order in the
turn of a step. With d the distance at the end of the step and vn, vt the components of (vj - vi) dt along n and
t there, exactly (vj - vi).t' dt = vt d / d', d'^2 = (d - vn/2)^2 + (vt/2)^2, and to second order

    d / d' = 1 + a + a^2 - b,   a = vn / 2d,   b = (vt / d)^2 / 8.               (4)

A contact exists while g - gr < 0 or bonded. The springs' forces are kept (`normal`, `shear`); what dashpots and
parallel bonds add goes to the discs as well. Sources: Cundall & Strack (1979), Géotechnique 29, 47-65; for
each law its file in `effects`.
"""

from coupler_protocol.jit import jit
from dem_server import neighbours, walls
from dem_server.effects import bond as bond_law
from dem_server.effects import dashpot as dashpot_law
from dem_server.effects import friction as friction_law
from dem_server.effects import parallel_bond as parallel_law
from dem_server.effects import rolling as rolling_law
from dem_server.effects import spring as spring_law
from dem_server.effects.bond import BONDED, BROKEN_TENSION
from dem_server.model import SHEAR_BREAKS, TENSION_BREAKS
from dem_server.walls import wall_pass

normal_force = jit(spring_law.normal_force)
shear_force = jit(spring_law.shear_force)
slip_limit = jit(friction_law.slip_limit)
clipped = jit(friction_law.clipped)
bond_after = jit(bond_law.bond_after)
effective_radius = jit(rolling_law.effective_radius)
rolling_stiffness = jit(rolling_law.rolling_stiffness)
rolling_moment = jit(rolling_law.rolling_moment)
rolling_limit = jit(rolling_law.rolling_limit)
viscous_force = jit(dashpot_law.viscous_force)
bond_radius = jit(parallel_law.bond_radius)
bending_stiffness = jit(parallel_law.bending_stiffness)
parallel_bond_after = jit(parallel_law.parallel_bond_after)


def contact_forces(model, state):
    """Forces and moments on all discs, ring included, from the motion of this step; bonds may break.

    Rebuilds the neighbour list first if a disc has moved too far since the last time. Shear forces grow with
    every call by the slip of the present velocities: call it once a step.
    """
    while not force_pass(*arguments(model, state)):
        neighbours.rebuild(model, state)
    if state.walls is not None:
        wall_pass(state.disc, state.load, state.dt, *walls.arguments(model, state))


def arguments(model, state):
    """What `force_pass` takes."""
    law = model.law
    return (
        state.disc, state.load, state.listed_at, state.used, state.partner, state.kind,
        state.normal, state.shear, state.reference_gap, state.bond_state, state.rolled, state.root_mass, state.parallel,
        state.counters, law.spring, law.friction, law.bond, law.rolling, law.dashpot, law.parallel_bond,
        neighbours.skin(model), state.dt,
    )  # fmt: skip


@jit
def force_pass(
    disc, load, listed_at, used, partner, kind,
    normal, shear, reference_gap, bond_state, rolled, root_mass, parallel,
    counters, spring, friction, bond, rolling, dashpot, parallel_bond, skin, dt,
):  # fmt: skip
    """Eqs (1) to (4) for all listed pairs; False, with nothing done, if the list is out of date."""
    n = disc.shape[0]
    for i in range(n):
        dx, dy = disc[i, 0] - listed_at[i, 0], disc[i, 1] - listed_at[i, 1]
        if not dx * dx + dy * dy <= 0.25 * skin * skin:
            return False
    for i in range(n):
        load[i, 0] = load[i, 1] = load[i, 2] = 0.0

    for i in range(n):
        xi, yi, ui, vi, wi, ri = disc[i, 0], disc[i, 1], disc[i, 2], disc[i, 3], disc[i, 4], disc[i, 5]
        fx = fy = mi = 0.0
        for s in range(used[i]):
            j = partner[i, s]
            dx, dy = disc[j, 0] - xi, disc[j, 1] - yi
            touch = ri + disc[j, 5]
            if reference_gap is not None:
                touch += reference_gap[i, s]
            bonded = False
            if bond is not None:
                bonded = bond_state[i, s] == BONDED
            held = bonded
            if parallel_bond is not None:
                held = bonded or parallel.state[i, s] == BONDED
            d2 = dx * dx + dy * dy
            if d2 >= touch * touch and not held:
                normal[i, s] = 0.0
                if shear is not None:
                    shear[i, s] = 0.0
                if rolling is not None:
                    rolled[i, s] = 0.0
                continue

            k = kind[i, s]
            d = d2**0.5
            inv = 1.0 / d
            nx, ny = dx * inv, dy * inv
            Fn = normal_force(spring.normal[k], d - touch)
            Fs = 0.0
            if shear is not None:
                half = 0.5 * (d - ri - disc[j, 5])
                li, lj = ri + half, disc[j, 5] + half
                du, dv = (disc[j, 2] - ui) * dt, (disc[j, 3] - vi) * dt
                vn, vt = du * nx + dv * ny, dv * nx - du * ny
                a, b = 0.5 * vn * inv, 0.125 * (vt * inv) ** 2
                slip = vt * (1.0 + a + a * a - b) - wi * dt * li - disc[j, 4] * dt * lj
                Fs = shear_force(spring.shear[k], slip, shear[i, s])
                if bond is not None:  # noqa: SIM102 (numba prunes this line only if it stands alone)
                    if bonded:
                        now = bond_after(Fn, Fs, bond.tension[k], bond.shear[k])
                        if now != BONDED:
                            bonded = False
                            bond_state[i, s] = now
                            counters[TENSION_BREAKS if now == BROKEN_TENSION else SHEAR_BREAKS] += 1
                limit = 0.0
                if not bonded:
                    Fn = max(Fn, 0.0)
                    if friction is not None:
                        limit = slip_limit(friction.coefficient[k], Fn)
                    Fs = clipped(Fs, limit)
                shear[i, s] = Fs
            normal[i, s] = Fn
            if rolling is not None:
                rb = effective_radius(ri, disc[j, 5])
                mr = rolling_moment(rolling_stiffness(spring.shear[k], rb), (disc[j, 4] - wi) * dt, rolled[i, s])
                mr = clipped(mr, rolling_limit(rolling.coefficient[k], rb, Fn))
                rolled[i, s] = mr  # moment on j; on i the opposite
                mi -= mr
                load[j, 2] += mr
            if dashpot is not None:  # noqa: SIM102 (numba prunes this line only if it stands alone)
                if bonded or d2 < touch * touch:
                    du, dv = disc[j, 2] - ui, disc[j, 3] - vi
                    rate = dv * nx - du * ny - wi * li - disc[j, 4] * lj
                    Fn += viscous_force(dashpot.normal[k], root_mass[i, s], du * nx + dv * ny)
                    Fs += viscous_force(dashpot.shear[k], root_mass[i, s], rate)
                    if not bonded:
                        if not dashpot.tension[k]:
                            Fn = max(Fn, 0.0)
                        Fs = clipped(Fs, limit)
            if parallel_bond is not None:  # noqa: SIM102 (numba prunes this line only if it stands alone)
                if parallel.state[i, s] == BONDED:
                    R = bond_radius(parallel_bond.radius[k], ri, disc[j, 5])
                    A = 2.0 * R
                    Pn = normal_force(parallel_bond.normal[k] * A, 2.0 * half - parallel.gap[i, s])
                    Ps = shear_force(parallel_bond.shear[k] * A, slip, parallel.shear[i, s])
                    bending = bending_stiffness(parallel_bond.normal[k], R)
                    Pm = rolling_moment(bending, (disc[j, 4] - wi) * dt, parallel.moment[i, s])
                    now = parallel_bond_after(Pn, Ps, Pm, R, parallel_bond.tension[k], parallel_bond.cohesion[k])
                    if now != BONDED:
                        Pn = Ps = Pm = 0.0
                        parallel.state[i, s] = now
                        counters[TENSION_BREAKS if now == BROKEN_TENSION else SHEAR_BREAKS] += 1
                    parallel.normal[i, s], parallel.shear[i, s], parallel.moment[i, s] = Pn, Ps, Pm
                    Fn += Pn
                    Fs += Ps
                    mi -= Pm
                    load[j, 2] += Pm
            if shear is not None:
                mi -= Fs * li
                load[j, 2] -= Fs * lj
            px, py = Fn * nx - Fs * ny, Fn * ny + Fs * nx
            fx -= px
            fy -= py
            load[j, 0] += px
            load[j, 1] += py
        load[i, 0] += fx
        load[i, 1] += fy
        load[i, 2] += mi
    return True
