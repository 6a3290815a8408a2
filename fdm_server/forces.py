"""Forces of zones on their corners, and their sum at gridpoints.

A triangle with stress sigma and area A pulls corner k by -A sigma grad N_k. With r1 = b - a, r2 = c - a:

    f_b = -(xx y2 - xy x2,  xy y2 - yy x2)/2        f_c = (xx y1 - xy x1,  xy y1 - yy x1)/2        f_a = -f_b - f_c

Both overlaid pairs of triangles fill the zone, so each counts half. The mean stress sm is one for the zone: its forces follow from the
outline of the zone alone.
"""

from coupler_protocol.jit import jit
from fdm_server.blocks import LANES
from fdm_server.strain import C0, C1, C2, C3, V
from fdm_server.stress import SD, SM, XY

CORNER_ROWS = 8


@jit
def pressure_forces(b, x, y, stress, f):
    """Set f to the forces of sm, which is constant over each zone: corner k feels half the traction on its two neighbours' chord."""
    for i in range(LANES):
        half = 0.5 * stress[b, SM + i]
        ax, ay = half * (y[b, C3 + i] - y[b, C1 + i]), half * (x[b, C1 + i] - x[b, C3 + i])
        bx, by = half * (y[b, C0 + i] - y[b, C2 + i]), half * (x[b, C2 + i] - x[b, C0 + i])
        f[C0 + i] = ax
        f[C1 + i] = bx
        f[C2 + i] = -ax
        f[C3 + i] = -bx
        f[V + C0 + i] = ay
        f[V + C1 + i] = by
        f[V + C2 + i] = -ay
        f[V + C3 + i] = -by


@jit
def triangle_forces(b, t, p, q, r, x, y, stress, f):
    """Add the forces of sd and xy of triangle t to the rows of its corners p, q, r in f."""
    for i in range(LANES):
        x1, x2 = x[b, q + i] - x[b, p + i], x[b, r + i] - x[b, p + i]
        y1, y2 = y[b, q + i] - y[b, p + i], y[b, r + i] - y[b, p + i]
        sd, xy = 0.25 * stress[b, SD + t * LANES + i], 0.25 * stress[b, XY + t * LANES + i]
        bx, by = xy * x2 - sd * y2, -sd * x2 - xy * y2
        cx, cy = sd * y1 - xy * x1, xy * y1 + sd * x1
        f[p + i] -= bx + cx
        f[q + i] += bx
        f[r + i] += cx
        f[V + p + i] -= by + cy
        f[V + q + i] += by
        f[V + r + i] += cy


@jit
def corner_forces(b, x, y, stress, f, corner_force):
    """Forces [N] of the zones of block b on their corners, 8 rows as the velocities; f is working space."""
    pressure_forces(b, x, y, stress, f)
    triangle_forces(b, 0, C0, C1, C2, x, y, stress, f)
    triangle_forces(b, 1, C0, C2, C3, x, y, stress, f)
    triangle_forces(b, 2, C0, C1, C3, x, y, stress, f)
    triangle_forces(b, 3, C1, C2, C3, x, y, stress, f)
    for k in range(8 * LANES):
        corner_force[b, k] = f[k]


@jit
def sum_at_gridpoints(start, place, corner_force, force):
    """Sum of the corner forces on every gridpoint, in fixed order: force (N,2) [N]."""
    flat = corner_force.reshape(corner_force.size)
    for n in range(force.shape[0]):
        fx = fy = 0.0
        for k in range(start[n], start[n + 1]):
            fx += flat[place[k]]
            fy += flat[place[k] + V]
        force[n, 0] = fx
        force[n, 1] = fy
