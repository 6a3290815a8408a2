"""A step of discs as one writes it first: a list of pairs, one after the other, forces added to both discs on the way.

The same mathematics as dem_server with springs, friction and local damping, each quantity in an array of its own, without
records or blocks. It is the yardstick of scripts/bench_step.py, compiled by the same compiler in the same
run. The pairs are given: it neither builds lists nor asks whether they are out of date.
"""

from math import sqrt

from coupler_protocol.compiled.jit import jit


@jit(package="dem_server")
def step_of_discs(first, alpha, mass, inertia, radius, x, v, spin, a, b, kn, ks, mu, shear, force, moment):
    """Motion of discs `first`..n-1 (dt = 1, no gravity), then forces (n,2) and moments (n,) of the pairs a, b (m,).

    alpha: local damping; mass, inertia, radius (n,); x, v (n,2), spin (n,), shear (m,) go on; kn, ks [N/m] and mu of all pairs.
    """
    for i in range(first, len(x)):
        for k in range(2):
            v[i, k] += damped(force[i, k], v[i, k], alpha) / mass[i]
            x[i, k] += v[i, k]
        spin[i] += damped(moment[i], spin[i], alpha) / inertia[i]
    force[:] = 0.0
    moment[:] = 0.0
    for c in range(len(a)):
        i, j = a[c], b[c]
        dx, dy = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1]
        d = sqrt(dx * dx + dy * dy)
        overlap = radius[i] + radius[j] - d
        if overlap <= 0.0:
            shear[c] = 0.0
            continue
        nx, ny = dx / d, dy / d
        li, lj = radius[i] - 0.5 * overlap, radius[j] - 0.5 * overlap
        du, dv = v[j, 0] - v[i, 0], v[j, 1] - v[i, 1]
        vn, vt = du * nx + dv * ny, dv * nx - du * ny
        before = sqrt((d - 0.5 * vn) ** 2 + 0.25 * vt * vt)  # distance at mid-step
        slip = vt * d / before - spin[i] * li - spin[j] * lj
        fn = kn * overlap
        fs = min(max(shear[c] - ks * slip, -mu * fn), mu * fn)
        shear[c] = fs
        fx, fy = fn * nx - fs * ny, fn * ny + fs * nx
        force[i, 0] -= fx
        force[i, 1] -= fy
        force[j, 0] += fx
        force[j, 1] += fy
        moment[i] -= fs * li
        moment[j] -= fs * lj


@jit(package="dem_server")
def damped(force, velocity, alpha):
    """Unbalanced force with its local damping."""
    if velocity > 0.0:
        return force - alpha * abs(force)
    if velocity < 0.0:
        return force + alpha * abs(force)
    return force
