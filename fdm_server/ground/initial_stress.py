"""Initial stress of the ground: uniform, growing with depth, or from the weight of the ground above.

At the height y, with d = level - y:

    s = s_0 + d ds/dd          or          yy = yy_0 - W,  xx = xx_0 - k0 W,  zz = zz_0 - k0 W

W = g (sum of density times thickness of the ground vertically above). Every zone gets the stress at its centre.
"""

from dataclasses import replace

import numpy as np
import shapely

from fdm_server.effects import with_damping
from fdm_server.mesh.grid import centroids
from fdm_server.model import new_state
from fdm_server.step.blocks import to_blocks
from fdm_server.step.zone_pass import advance


def initial_state(scene, model, gravity=None):
    """A model at rest with the scene's initial stress; gravity [m/s2] of the ground's weight, None: that of the first stage."""
    state = new_state(model)
    if scene.initial_stress is not None:
        if gravity is None:
            gravity = scene.stage[0].gravity or 0.0
            factor = scene.stage[0].gravity_factor
            gravity *= factor.to if factor is not None and factor.over == 0 else 1.0
        set_stress(model, state, stress_field(scene.initial_stress, scene.material, model, gravity))
    return state


def set_stress(model, state, stress):
    """Sets the stresses (A,4) [Pa] xx, yy, zz, xy of the active zones, and their forces on gridpoints.

    Stresses beyond the strength are reduced to the strength.
    """
    xx, yy, zz, xy = stress.T
    sd = 0.5 * (xx - yy)
    state.stress[:] = to_blocks(np.column_stack([0.5 * (xx + yy), zz, sd, sd, sd, sd, xy, xy, xy, xy]))
    velocity = state.velocity
    state.velocity = np.zeros_like(velocity)
    advance(replace(model, law=with_damping(model.law, None)), state)  # a step at rest: laws and forces, no motion
    state.velocity = velocity


def stress_field(table, materials, model, gravity):
    """Stresses (A,4) [Pa] xx, yy, zz, xy at the centres of the active zones; gravity [m/s2] of the first stage."""
    centre = centroids(model.grid.xy, model.zones)
    stress = np.tile([table.xx, table.yy, table.zz, table.xy], (len(centre), 1))
    if table.gradient is not None:
        g = table.gradient
        stress += (table.level - centre[:, 1])[:, None] * np.array([g.xx, g.yy, g.zz, g.xy])
    if table.k0 is not None:
        weight = gravity * overburden(model, materials, centre)
        stress -= weight[:, None] * np.array([table.k0, 1.0, table.k0, 0.0])
    return stress


def overburden(model, materials, points):
    """Mass per area (n,) [kg/m2] of the ground vertically above points (n,2) [m]."""
    ground = shapely.coverage_union_all(shapely.polygons(model.grid.xy[model.zones]))
    low, high = ground.bounds[1] - 1.0, ground.bounds[3] + 1.0
    above = shapely.linestrings(np.stack([points, np.column_stack([points[:, 0], np.full(len(points), high)])], axis=1))
    mass, taken = np.zeros(len(points)), shapely.Polygon()
    for material in reversed(materials):  # the last one that fills a place counts
        part = ground
        if material.region is not None:
            part = shapely.intersection(ground, shapely.Polygon(material.region))
        elif material.top is not None:
            ends = np.array([material.top[0], material.top[-1]])
            ends[0, 0] = min(ends[0, 0], ground.bounds[0]) - 1.0
            ends[1, 0] = max(ends[1, 0], ground.bounds[2]) + 1.0
            line = [tuple(ends[0]), *material.top, tuple(ends[1])]
            part = shapely.intersection(ground, shapely.Polygon([*line, (line[-1][0], low), (line[0][0], low)]))
        part = shapely.difference(part, taken)
        taken = shapely.union(taken, part)
        mass += material.density * shapely.length(shapely.intersection(above, part))
    return mass
