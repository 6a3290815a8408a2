"""Forces and virials of walls on every disc, for frames.

    force = -sum (Fn n + Fs t),     virial = sum sym(f (x) d n)                  (1)

over the walls a disc touches (dem_server/step/walls.py); f: force of a wall on the disc, d n: from the centre of the disc's body
to the nearest point of the wall. The sum of virials over an area is the walls' part of its mean stress
(dem_server/insitu/contact_stress.py).
"""

import numpy as np

from dem_server.pairs import body_centres
from dem_server.step.walls import near


def on_discs(state):
    """Force (n, 2) [N] and virial (n, 4) as xx, yy, zz, xy [N m] of all walls on every disc, of springs and friction."""
    disc, wall, normal, distance = near(state, 0.0)
    along = np.column_stack([-normal[:, 1], normal[:, 0]])
    force = -(state.walls.normal[disc, wall][:, None] * normal + state.walls.shear[disc, wall][:, None] * along)
    arm = state.x[disc] + distance[:, None] * normal - body_centres(state)[disc]
    (fx, fy), (lx, ly) = force.T, arm.T
    total, virial = np.zeros((len(state.x), 2)), np.zeros((len(state.x), 4))
    np.add.at(total, disc, force)
    np.add.at(virial, disc, np.column_stack([fx * lx, fy * ly, 0.0 * fx, 0.5 * (fx * ly + fy * lx)]))
    return total, virial
