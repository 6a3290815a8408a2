"""The law of a block of contacts: all effects in acting order; absent effects are compiled away.

Geometry of a contact (2-D, unit thickness), unit vectors n from i to j, t = (-ny, nx):

    g = |xj - xi| - ri - rj,   li = ri + g/2,   lj = rj + g/2                    (1)
    slip = ((vj - vi).t' - wi li - wj lj) dt                                     (2)
    force on j: Fn n + Fs t, on i the opposite;  moments -Fs li, -Fs lj          (3)

t' is the tangent at mid-step, so that a rigid rotation of both discs gives no slip up to third order in the
rotation of a step. With d the distance at the end of the step and vn, vt the components of (vj - vi) dt along n and
t there, exactly (vj - vi).t' dt = vt d / d', d'^2 = (d - vn/2)^2 + (vt/2)^2, and to second order

    d / d' = 1 + a + a^2 - b,   a = vn / 2d,   b = (vt / d)^2 / 8.               (4)

A contact exists while g - gr < 0 or bonded; the limits Fn >= 0, |Fs| <= mu Fn give zero force to other pairs. Rows FN, SHEAR
contain the forces of springs; forces of dashpots and parallel bonds also act on the discs. Two discs at one position have no
normal and no force. Sources: Cundall & Strack (1979), Géotechnique 29, 47-65; for each law its file in `effects`.
"""

from math import sqrt

from coupler_protocol.compiled.jit import jit
from dem_server.effects.bond import BONDED
from dem_server.step import scratch_rows
from dem_server.step.compiled_laws import (
    bending_stiffness,
    bond_after,
    bond_radius,
    clipped,
    effective_radius,
    normal_force,
    parallel_bond_after,
    rolling_limit,
    rolling_moment,
    rolling_stiffness,
    shear_force,
    slip_limit,
    viscous_force,
)

NOWHERE = 1e-150  # [m]: distance below which two centres have no direction


@jit(forceinline=True, borrows=True)
def law_of_block(m, dt, f, shear, reference_gap, friction, bond, rolling, dashpot, parallel_bond):
    """Computes Eqs (1) to (4) for the m contacts whose rows are in the scratch memory f; returns the number of broken bonds.

    Effects are None or not; their parameters are in rows.
    """
    broken = 0
    for q in range(m):
        dx, dy, du, dv = f[scratch_rows.DX + q], f[scratch_rows.DY + q], f[scratch_rows.DU + q], f[scratch_rows.DV + q]
        ri, rj, wi, wj = f[scratch_rows.RI + q], f[scratch_rows.RJ + q], f[scratch_rows.WI + q], f[scratch_rows.WJ + q]
        d = sqrt(dx * dx + dy * dy)
        inv = 1.0 / max(d, NOWHERE)
        nx, ny = dx * inv, dy * inv
        gap = d - ri - rj
        g = gap
        if reference_gap is not None:
            g = gap - f[scratch_rows.GAP + q]
        spring = normal_force(f[scratch_rows.KN + q], g)
        Fn, Fs, mi, mj = max(spring, 0.0), 0.0, 0.0, 0.0
        if shear is not None:
            li, lj = ri + 0.5 * gap, rj + 0.5 * gap
            vn, vt = (du * nx + dv * ny) * dt, (dv * nx - du * ny) * dt
            a, b = 0.5 * vn * inv, 0.125 * (vt * inv) * (vt * inv)
            slip = vt * (1.0 + a + a * a - b) - wi * dt * li - wj * dt * lj
            stuck, limit = shear_force(f[scratch_rows.KS + q], slip, f[scratch_rows.SHEAR + q]), 0.0
            if friction is not None:
                limit = slip_limit(f[scratch_rows.FRICTION + q], Fn)
            Fs = clipped(stuck, limit)
            if bond is not None:
                before = f[scratch_rows.BONDED + q]
                now = 1.0 * bond_after(spring, stuck, f[scratch_rows.TENSION + q], f[scratch_rows.STRENGTH + q])
                now = now if before == BONDED else before
                holds = now == BONDED
                Fn, Fs = spring if holds else Fn, stuck if holds else Fs
                f[scratch_rows.BONDED + q] = now
                broken += 1 if now != before else 0
            f[scratch_rows.SHEAR + q] = Fs
        f[scratch_rows.FN + q] = Fn
        if rolling is not None:
            rb = effective_radius(ri, rj)
            mr = rolling_moment(rolling_stiffness(f[scratch_rows.KS + q], rb), (wj - wi) * dt, f[scratch_rows.ROLLED + q])
            mr = clipped(mr, rolling_limit(f[scratch_rows.ROLLING + q], rb, Fn))
            f[scratch_rows.ROLLED + q] = mr  # moment on j; on i the opposite
            mi += mr
            mj -= mr
        if dashpot is not None:
            vn, vs = du * nx + dv * ny, dv * nx - du * ny - wi * li - wj * lj
            Dn = Fn + viscous_force(f[scratch_rows.DASH_N + q], f[scratch_rows.ROOT + q], vn)
            Ds = Fs + viscous_force(f[scratch_rows.DASH_S + q], f[scratch_rows.ROOT + q], vs)
            free_n, free_s = max(Dn, 0.0) if f[scratch_rows.PULLS + q] == 0.0 else Dn, clipped(Ds, limit)
            holds = False
            if bond is not None:
                holds = f[scratch_rows.BONDED + q] == BONDED
            touches = g < 0.0
            Fn = Dn if holds else (free_n if touches else Fn)
            Fs = Ds if holds else (free_s if touches else Fs)
        if parallel_bond is not None:
            R = bond_radius(f[scratch_rows.GLUE_RADIUS + q], min(ri, rj))
            Pn = normal_force(f[scratch_rows.GLUE_KN + q] * 2.0 * R, gap - f[scratch_rows.GLUE_GAP + q])
            Ps = shear_force(f[scratch_rows.GLUE_KS + q] * 2.0 * R, slip, f[scratch_rows.GLUE_S + q])
            Pm = rolling_moment(bending_stiffness(f[scratch_rows.GLUE_KN + q], R), (wj - wi) * dt, f[scratch_rows.GLUE_M + q])
            before = f[scratch_rows.GLUED + q]
            now = 1.0 * parallel_bond_after(Pn, Ps, Pm, R, f[scratch_rows.GLUE_TENSION + q], f[scratch_rows.GLUE_COHESION + q])
            now = now if before == BONDED else before
            holds = now == BONDED
            Pn, Ps, Pm = Pn if holds else 0.0, Ps if holds else 0.0, Pm if holds else 0.0
            f[scratch_rows.GLUED + q] = now
            f[scratch_rows.GLUE_N + q], f[scratch_rows.GLUE_S + q], f[scratch_rows.GLUE_M + q] = Pn, Ps, Pm
            broken += 1 if now != before else 0
            Fn += Pn
            Fs += Ps
            mi += Pm
            mj -= Pm
        if shear is not None:
            mi += Fs * li
            mj += Fs * lj
        f[scratch_rows.PX + q], f[scratch_rows.PY + q] = Fn * nx - Fs * ny, Fn * ny + Fs * nx
        f[scratch_rows.MI + q], f[scratch_rows.MJ + q] = mi, mj
    return broken
