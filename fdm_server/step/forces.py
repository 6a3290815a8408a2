"""Forces of zones on their corners, and their sum at gridpoints.

The force of a triangle with stress sigma and area A on corner k is -A sigma grad N_k. With r1 = b - a, r2 = c - a:

    f_b = -(xx y2 - xy x2,  xy y2 - yy x2)/2
    f_c =  (xx y1 - xy x1,  xy y1 - yy x1)/2        f_a = -f_b - f_c

Both overlaid pairs of triangles fill the zone, so each counts half. The mean stress sm is a value of the zone:
its forces follow from the outline of the zone alone.
"""

from coupler_protocol.compiled.jit import jit
from fdm_server.step.blocks import LANES
from fdm_server.step.strain import C0, C1, C2, C3, T0, T1, T2, T3, V
from fdm_server.step.stress import SD, SM, XY

CORNER_ROWS = 8


@jit(forceinline=True)
def triangle_forces(sd, xy, x1, y1, x2, y2):
    """Forces of sd and xy on corners b and c of a triangle, at half weight: (f_b x, f_b y, f_c x, f_c y)."""
    sd, xy = 0.25 * sd, 0.25 * xy
    return xy * x2 - sd * y2, -sd * x2 - xy * y2, sd * y1 - xy * x1, xy * y1 + sd * x1


@jit
def corner_forces(b, x, y, stress, corner_force):
    """Computes forces [N] of the zones of block b on their corners: 8 rows, x at the four corners, then y."""
    for i in range(LANES):
        x1, x2, x3 = x[b, C1 + i] - x[b, C0 + i], x[b, C2 + i] - x[b, C0 + i], x[b, C3 + i] - x[b, C0 + i]
        y1, y2, y3 = y[b, C1 + i] - y[b, C0 + i], y[b, C2 + i] - y[b, C0 + i], y[b, C3 + i] - y[b, C0 + i]

        half = 0.5 * stress[b, SM + i]  # half of the pressure on the chord between its neighbours acts on corner k
        f1x, f1y, f2x, f2y, f3x, f3y = (
            -half * y2,
            half * x2,
            half * (y1 - y3),
            half * (x3 - x1),
            half * y2,
            -half * x2,
        )

        bx, by, cx, cy = triangle_forces(stress[b, SD + T0 + i], stress[b, XY + T0 + i], x1, y1, x2, y2)
        f1x, f1y, f2x, f2y = f1x + bx, f1y + by, f2x + cx, f2y + cy
        bx, by, cx, cy = triangle_forces(stress[b, SD + T1 + i], stress[b, XY + T1 + i], x2, y2, x3, y3)
        f2x, f2y, f3x, f3y = f2x + bx, f2y + by, f3x + cx, f3y + cy
        bx, by, cx, cy = triangle_forces(stress[b, SD + T2 + i], stress[b, XY + T2 + i], x1, y1, x3, y3)
        f1x, f1y, f3x, f3y = f1x + bx, f1y + by, f3x + cx, f3y + cy
        sd, xy = stress[b, SD + T3 + i], stress[b, XY + T3 + i]
        bx, by, cx, cy = triangle_forces(sd, xy, x2 - x1, y2 - y1, x3 - x1, y3 - y1)
        f1x, f1y, f2x, f2y, f3x, f3y = f1x - bx - cx, f1y - by - cy, f2x + bx, f2y + by, f3x + cx, f3y + cy

        corner_force[b, C0 + i] = -(f1x + f2x + f3x)
        corner_force[b, C1 + i] = f1x
        corner_force[b, C2 + i] = f2x
        corner_force[b, C3 + i] = f3x
        corner_force[b, V + C0 + i] = -(f1y + f2y + f3y)
        corner_force[b, V + C1 + i] = f1y
        corner_force[b, V + C2 + i] = f2y
        corner_force[b, V + C3 + i] = f3y


@jit
def sum_at_gridpoints(order, first, last, start, place, corner_force, force):
    """Computes the sums of corner forces on the gridpoints order[first:last], each in fixed order: force (N,2) [N]."""
    flat = corner_force.reshape(corner_force.size)
    for k in range(first, last):
        n = order[k]
        fx = fy = 0.0
        for j in range(start[n], start[n + 1]):
            fx += flat[place[j]]
            fy += flat[place[j] + V]
        force[n, 0] = fx
        force[n, 1] = fy


def sum_all(model, corner_force, force):
    """Computes the sums of corner forces on all gridpoints."""
    order = model.partition.order
    sum_at_gridpoints(order, 0, len(order), model.start, model.place, corner_force, force)
