"""Strain increments of zones from the velocities of their corners (Gauss' theorem), with mixed discretisation.

A triangle abc with r1 = b - a, r2 = c - a and velocity differences du1 = u_b - u_a, du2 = u_c - u_a deforms by

    du/dx = (du1 y2 - du2 y1)/2A        du/dy = (du2 x1 - du1 x2)/2A

Triangles in a mesh are too stiff where volume is kept (plastic flow). Therefore the deviator belongs to each triangle, the dilation e
to the whole zone (Marti & Cundall 1982, Int. J. Numer. Anal. Methods Geomech. 6): the area mean over its triangles,

    e = [(u0 - u2)(y1 - y3) + (u1 - u3)(y2 - y0) + (v0 - v2)(x3 - x1) + (v1 - v3)(x0 - x2)]/2A
"""

from coupler_protocol.jit import jit
from fdm_server.blocks import LANES

C0, C1, C2, C3 = (k * LANES for k in range(4))  # rows of the corners
V = 4 * LANES  # from a corner's row of u to its row of v
DILATION, DIFFERENCE, GAMMA = (k * LANES for k in (0, 1, 5))  # rows of strain; one a triangle but for the dilation
STRAIN_ROWS = 9


@jit
def gather_velocities(b, corner, velocity, u):
    """Corner velocities u [m/s] of block b, 8 rows: x at the four corners, then y, from velocity (N,2)."""
    for k in range(4 * LANES):
        point = corner[b, k]
        u[k] = velocity[point, 0]
        u[V + k] = velocity[point, 1]


@jit
def triangle_strain(b, t, p, q, r, x, y, inverse_double_area, u, strain):
    """Deviatoric strain increments of triangle t, whose corners stand in rows p, q, r."""
    for i in range(LANES):
        x1, x2 = x[b, q + i] - x[b, p + i], x[b, r + i] - x[b, p + i]
        y1, y2 = y[b, q + i] - y[b, p + i], y[b, r + i] - y[b, p + i]
        du1, du2 = u[q + i] - u[p + i], u[r + i] - u[p + i]
        dv1, dv2 = u[V + q + i] - u[V + p + i], u[V + r + i] - u[V + p + i]
        inverse = inverse_double_area[b, t * LANES + i]
        strain[DIFFERENCE + t * LANES + i] = inverse * ((du1 * y2 - du2 * y1) - (dv2 * x1 - dv1 * x2))
        strain[GAMMA + t * LANES + i] = inverse * ((du2 * x1 - du1 * x2) + (dv1 * y2 - dv2 * y1))


@jit
def strain_increments(b, x, y, inverse_double_area, u, strain):
    """Strain increments [-] of block b in one step, 9 rows: e of the zones, then xx - yy and gamma_xy of each triangle."""
    for i in range(LANES):
        strain[DILATION + i] = inverse_double_area[b, 4 * LANES + i] * (
            (u[C0 + i] - u[C2 + i]) * (y[b, C1 + i] - y[b, C3 + i])
            + (u[C1 + i] - u[C3 + i]) * (y[b, C2 + i] - y[b, C0 + i])
            + (u[V + C0 + i] - u[V + C2 + i]) * (x[b, C3 + i] - x[b, C1 + i])
            + (u[V + C1 + i] - u[V + C3 + i]) * (x[b, C0 + i] - x[b, C2 + i])
        )
    triangle_strain(b, 0, C0, C1, C2, x, y, inverse_double_area, u, strain)
    triangle_strain(b, 1, C0, C2, C3, x, y, inverse_double_area, u, strain)
    triangle_strain(b, 2, C0, C1, C3, x, y, inverse_double_area, u, strain)
    triangle_strain(b, 3, C1, C2, C3, x, y, inverse_double_area, u, strain)
