"""Kernels of large strain for each block: present shape, shape at mid-step, and rotation of stresses with their zones.

A step of small strain contains none of them. The shapes of one block are scratch memory, (1, rows) like a block of `Geometry`, so
that the kernels of small strain can read them.
"""

import numpy as np

from coupler_protocol.compiled.jit import jit
from fdm_server.effects import large_strain as law
from fdm_server.step.blocks import LANES
from fdm_server.step.strain import C0, C1, C2, C3, T0, T1, T2, T3, V
from fdm_server.step.stress import SD, XY

half_turn = jit(law.half_turn, forceinline=True)
turned = jit(law.turned, forceinline=True)

COSINE, SINE = 0, 4 * LANES  # rows of the turn of four triangles
TURN_ROWS = 8


@jit(forceinline=True)
def double_areas(x, y, i):
    """Twice the areas [m2] of the triangles of lane i; exactly 0 if two corners are the same."""
    x1, x2, x3 = x[0, C1 + i] - x[0, C0 + i], x[0, C2 + i] - x[0, C0 + i], x[0, C3 + i] - x[0, C0 + i]
    y1, y2, y3 = y[0, C1 + i] - y[0, C0 + i], y[0, C2 + i] - y[0, C0 + i], y[0, C3 + i] - y[0, C0 + i]
    last = (x2 - x1) * (y3 - y1) - (x3 - x1) * (y2 - y1)
    return x1 * y2 - x2 * y1, x2 * y3 - x3 * y2, x1 * y3 - x3 * y1, last


@jit(forceinline=True)
def inverse(double):
    """1 over twice an area; for no area a number by which only zero is multiplied."""
    return 1.0 / (double if double > 0.0 else 1.0)


@jit(forceinline=True)
def inside_out(double, share):
    """1 for a triangle with a share of its zone (in the grid's shape) that has no area now, else 0."""
    return 1 if (share > 0.0) & (not double > 0.0) else 0


@jit
def present_shape(b, corner, grid_share, xy, displacement, x, y, share):
    """Sets corners x, y [m] of block b at xy + displacement (N,2), and shares; returns the number of inverted triangles."""
    for k in range(4 * LANES):
        point = corner[b, k]
        x[0, k] = xy[point, 0] + displacement[point, 0]
        y[0, k] = xy[point, 1] + displacement[point, 1]
    inverted = 0
    for i in range(LANES):
        d0, d1, d2, d3 = double_areas(x, y, i)
        whole = inverse(d0 + d1)
        share[0, T0 + i], share[0, T1 + i], share[0, T2 + i], share[0, T3 + i] = d0 * whole, d1 * whole, d2 * whole, d3 * whole
        inverted += inside_out(d0, grid_share[b, T0 + i]) + inside_out(d1, grid_share[b, T1 + i])
        inverted += inside_out(d2, grid_share[b, T2 + i]) + inside_out(d3, grid_share[b, T3 + i])
    return inverted


@jit
def middle_shape(end_x, end_y, u, x, y, inverse_double_area):
    """Sets corners x, y [m] half a step before `end_x`, `end_y`, and 1/2A [1/m2] of triangles and zones there."""
    for k in range(4 * LANES):
        x[0, k] = end_x[0, k] - 0.5 * u[k]
        y[0, k] = end_y[0, k] - 0.5 * u[V + k]
    for i in range(LANES):
        d0, d1, d2, d3 = double_areas(x, y, i)
        inverse_double_area[0, T0 + i] = inverse(d0)
        inverse_double_area[0, T1 + i] = inverse(d1)
        inverse_double_area[0, T2 + i] = inverse(d2)
        inverse_double_area[0, T3 + i] = inverse(d3)
        inverse_double_area[0, 4 * LANES + i] = inverse(d0 + d1)


@jit(forceinline=True)
def half_turn_row(x, y, inverse_double_area, u, t, a, b, c, turn):
    """Sets row t of the half rotations of triangles with corners in rows a, b, c."""
    for i in range(LANES):
        x1, x2 = x[0, b + i] - x[0, a + i], x[0, c + i] - x[0, a + i]
        y1, y2 = y[0, b + i] - y[0, a + i], y[0, c + i] - y[0, a + i]
        du1, du2 = u[b + i] - u[a + i], u[c + i] - u[a + i]
        dv1, dv2 = u[V + b + i] - u[V + a + i], u[V + c + i] - u[V + a + i]
        curl = inverse_double_area[0, t + i] * ((dv1 * y2 - dv2 * y1) - (du2 * x1 - du1 * x2))
        turn[COSINE + t + i], turn[SINE + t + i] = half_turn(0.25 * curl)


@jit
def half_turns(x, y, inverse_double_area, u, turn):
    """Sets cosines and sines of half of the step's rotation of the four triangles, from the shape at mid-step."""
    zero = np.int64(0)  # of the rows' numbers; for literal numbers numba would compile the function four times
    c0, c1, c2, c3 = zero + C0, zero + C1, zero + C2, zero + C3
    half_turn_row(x, y, inverse_double_area, u, zero + T0, c0, c1, c2, turn)
    half_turn_row(x, y, inverse_double_area, u, zero + T1, c0, c2, c3, turn)
    half_turn_row(x, y, inverse_double_area, u, zero + T2, c0, c1, c3, turn)
    half_turn_row(x, y, inverse_double_area, u, zero + T3, c1, c2, c3, turn)


@jit
def turn_stress(b, turn, stress):
    """Rotates the stresses of block b by half a step."""
    for i in range(LANES):
        for t in (T0, T1, T2, T3):
            sd, xy = stress[b, SD + t + i], stress[b, XY + t + i]
            stress[b, SD + t + i], stress[b, XY + t + i] = turned(sd, xy, turn[COSINE + t + i], turn[SINE + t + i])
