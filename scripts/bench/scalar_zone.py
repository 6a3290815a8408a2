"""A step of zones as one writes it first: one zone after the other, forces added to gridpoints on the way.

The same mathematics as fdm_server (mixed discretisation, Mohr-Coulomb with edges and apex, tension cut-off, flags), without
blocks, lanes or a gather. It is the yardstick of scripts/bench_step.py, compiled by the same compiler in the same run.
"""

from math import sqrt

import numpy as np

from coupler_protocol.compiled.jit import jit
from fdm_server.effects import mohr_coulomb as mohr_coulomb_law
from fdm_server.effects import tension as tension_law

plastic_return = jit(mohr_coulomb_law.plastic_return, package="fdm_server")
cut_off = jit(tension_law.cut_off, package="fdm_server")
CORNERS = ((0, 1, 2), (0, 2, 3), (0, 1, 3), (1, 2, 3))


@jit(package="fdm_server")
def step_of_zones(zones, xy, velocity, elastic, strength, tensile, stress, plastic, force):
    """Strain, stress (Z,10: sm, zz, four sd, four xy) and forces (N,2) of zones (Z,4) for one step of `velocity` (N,2)."""
    force[:] = 0.0
    change = np.empty(2)
    for z in range(zones.shape[0]):
        whole = dilation = 0.0
        for t in range(2):
            a, b, c = zones[z, CORNERS[t][0]], zones[z, CORNERS[t][1]], zones[z, CORNERS[t][2]]
            x1, y1, x2, y2 = xy[b, 0] - xy[a, 0], xy[b, 1] - xy[a, 1], xy[c, 0] - xy[a, 0], xy[c, 1] - xy[a, 1]
            whole += x1 * y2 - x2 * y1
            dilation += (velocity[b, 0] - velocity[a, 0]) * y2 - (velocity[c, 0] - velocity[a, 0]) * y1
            dilation += (velocity[c, 1] - velocity[a, 1]) * x1 - (velocity[b, 1] - velocity[a, 1]) * x2
        dilation /= whole
        stress[z, 0] += elastic[0] * dilation
        stress[z, 1] += elastic[2] * dilation
        change[:] = 0.0
        state = 0
        for t in range(4):
            a, b, c = zones[z, CORNERS[t][0]], zones[z, CORNERS[t][1]], zones[z, CORNERS[t][2]]
            x1, y1, x2, y2 = xy[b, 0] - xy[a, 0], xy[b, 1] - xy[a, 1], xy[c, 0] - xy[a, 0], xy[c, 1] - xy[a, 1]
            double = x1 * y2 - x2 * y1
            if not double > 0.0:
                continue
            du1, du2 = velocity[b, 0] - velocity[a, 0], velocity[c, 0] - velocity[a, 0]
            dv1, dv2 = velocity[b, 1] - velocity[a, 1], velocity[c, 1] - velocity[a, 1]
            sd = stress[z, 2 + t] + elastic[1] * ((du1 * y2 - du2 * y1) - (dv2 * x1 - dv1 * x2)) / double
            xy_ = stress[z, 6 + t] + elastic[1] * ((du2 * x1 - du1 * x2) + (dv1 * y2 - dv2 * y1)) / double
            sm, zz = stress[z, 0], stress[z, 1]
            r = sqrt(sd * sd + xy_ * xy_)
            low, high = sm - r, sm + r
            s1, s2, s3 = min(low, zz), max(low, min(high, zz)), max(high, zz)
            t1, t2, t3, sheared = plastic_return(s1, s2, s3, *strength)
            t1, t2, t3, opened = cut_off(t1, t2, t3, *tensile)
            if sheared or opened:
                state |= (1 if sheared else 0) | (2 if opened else 0)
                new_low, new_high = (t2 if zz < low else t1), (t2 if zz > high else t3)
                across = t1 if zz < low else (t3 if zz > high else t2)
                turn = 0.5 * (new_high - new_low) / r if r > 0.0 else 0.0
                sd, xy_ = turn * sd, turn * xy_
                change[0] += 0.5 * double / whole * (0.5 * (new_low + new_high) - sm)
                change[1] += 0.5 * double / whole * (across - zz)
            stress[z, 2 + t], stress[z, 6 + t] = sd, xy_
        stress[z, 0] += change[0]
        stress[z, 1] += change[1]
        plastic[z] = state | ((plastic[z] & 3) << 2) | (plastic[z] & 12)
        for t in range(4):
            a, b, c = zones[z, CORNERS[t][0]], zones[z, CORNERS[t][1]], zones[z, CORNERS[t][2]]
            x1, y1, x2, y2 = xy[b, 0] - xy[a, 0], xy[b, 1] - xy[a, 1], xy[c, 0] - xy[a, 0], xy[c, 1] - xy[a, 1]
            if not x1 * y2 - x2 * y1 > 0.0:
                continue
            xx, yy = 0.25 * (stress[z, 0] + stress[z, 2 + t]), 0.25 * (stress[z, 0] - stress[z, 2 + t])
            s = 0.25 * stress[z, 6 + t]
            bx, by = -(xx * y2 - s * x2), -(s * y2 - yy * x2)
            cx, cy = xx * y1 - s * x1, s * y1 - yy * x1
            force[b, 0] += bx
            force[b, 1] += by
            force[c, 0] += cx
            force[c, 1] += cy
            force[a, 0] -= bx + cx
            force[a, 1] -= by + cy
