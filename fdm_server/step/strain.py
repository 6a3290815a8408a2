"""Strain increments of zones from the velocities of their corners, Gauss' theorem and mixed discretisation.

For a triangle abc with r1 = b - a, r2 = c - a and velocity differences du1 = u_b - u_a, du2 = u_c - u_a

    du/dx = (du1 y2 - du2 y1)/2A        du/dy = (du2 x1 - du1 x2)/2A

Triangles in a mesh are too stiff if the volume is constant (plastic flow). Therefore the deviator belongs to each
triangle, the dilation e to the whole zone (Marti & Cundall 1982, Int. J. Numer. Anal. Methods Geomech. 6, 129-139)
as the area mean over its triangles,

    e = [(u0 - u2)(y1 - y3) + (u1 - u3)(y2 - y0) + (v0 - v2)(x3 - x1) + (v1 - v3)(x0 - x2)]/2A
"""

from coupler_protocol.compiled.jit import jit
from fdm_server.step.blocks import LANES

C0, C1, C2, C3 = (k * LANES for k in range(4))  # rows of the corners of a zone
T0, T1, T2, T3 = C0, C1, C2, C3  # rows of its triangles (0,1,2), (0,2,3), (0,1,3), (1,2,3)
V = 4 * LANES  # distance from a corner's row of u to its row of v
# rows of strain: one of dilation e, then eps_xx - eps_yy and gamma_xy of the four triangles
DILATION, DIFFERENCE, GAMMA = (k * LANES for k in (0, 1, 5))
STRAIN_ROWS = 9


@jit
def gather_velocities(b, corner, velocity, u):
    """Copies velocity (N,2) to corner velocities u [m/s] of block b, 8 rows: x at the four corners, then y."""
    for k in range(4 * LANES):
        point = corner[b, k]
        u[k] = velocity[point, 0]
        u[V + k] = velocity[point, 1]


@jit
def gather_increments(b, corner, velocity, dt, u):
    """Sets u [m], 8 rows: displacements of a step dt [s] at the corners of block b."""
    for k in range(4 * LANES):
        point = corner[b, k]
        u[k] = dt * velocity[point, 0]
        u[V + k] = dt * velocity[point, 1]


@jit(forceinline=True)
def triangle_strain(inverse, x1, y1, x2, y2, du1, dv1, du2, dv2):
    """d eps_xx - d eps_yy and gamma_xy of a triangle [-]; inverse = 1/2A [1/m2]."""
    return (
        inverse * ((du1 * y2 - du2 * y1) - (dv2 * x1 - dv1 * x2)),
        inverse * ((du2 * x1 - du1 * x2) + (dv1 * y2 - dv2 * y1)),
    )


@jit
def strain_increments(b, x, y, inverse_double_area, u, strain):
    """Computes strain increments [-] of block b in one step: e of zones, xx - yy and gamma_xy of triangles."""
    for i in range(LANES):
        x1, x2, x3 = x[b, C1 + i] - x[b, C0 + i], x[b, C2 + i] - x[b, C0 + i], x[b, C3 + i] - x[b, C0 + i]
        y1, y2, y3 = y[b, C1 + i] - y[b, C0 + i], y[b, C2 + i] - y[b, C0 + i], y[b, C3 + i] - y[b, C0 + i]
        u1, u2, u3 = u[C1 + i] - u[C0 + i], u[C2 + i] - u[C0 + i], u[C3 + i] - u[C0 + i]
        v1, v2, v3 = (
            u[V + C1 + i] - u[V + C0 + i],
            u[V + C2 + i] - u[V + C0 + i],
            u[V + C3 + i] - u[V + C0 + i],
        )

        whole = inverse_double_area[b, 4 * LANES + i]
        strain[DILATION + i] = whole * (u2 * (y3 - y1) + (u1 - u3) * y2 - v2 * (x3 - x1) - (v1 - v3) * x2)

        inverse = inverse_double_area[b, T0 + i]
        strain[DIFFERENCE + T0 + i], strain[GAMMA + T0 + i] = triangle_strain(inverse, x1, y1, x2, y2, u1, v1, u2, v2)
        inverse = inverse_double_area[b, T1 + i]
        strain[DIFFERENCE + T1 + i], strain[GAMMA + T1 + i] = triangle_strain(inverse, x2, y2, x3, y3, u2, v2, u3, v3)
        inverse = inverse_double_area[b, T2 + i]
        strain[DIFFERENCE + T2 + i], strain[GAMMA + T2 + i] = triangle_strain(inverse, x1, y1, x3, y3, u1, v1, u3, v3)
        inverse = inverse_double_area[b, T3 + i]
        strain[DIFFERENCE + T3 + i], strain[GAMMA + T3 + i] = triangle_strain(
            inverse, *(x2 - x1, y2 - y1, x3 - x1, y3 - y1), *(u2 - u1, v2 - v1, u3 - u1, v3 - v1)
        )
