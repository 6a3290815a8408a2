"""Energies of the discs, for histories.

Kinetic: sum m v^2 / 2 + I w^2 / 2 with the masses of the motion (scaled ones in static mode). Stored in
contact springs: sum Fn^2 / 2 kn + Fs^2 / 2 ks.
"""

import numpy as np

from dem_server.fields import contacts


def kinetic(model, state):
    """Kinetic energy of the free discs [J]."""
    free = slice(model.ring, None)
    v2 = np.einsum("ij,ij->i", state.v[free], state.v[free])
    return 0.5 * float(np.dot(state.mass[free], v2) + np.dot(state.inertia[free], state.spin[free] ** 2))


def stored(model, state):
    """Elastic energy of all contacts [J]."""
    pairs, spring = contacts(state), model.law.spring
    normal = float(np.sum(pairs.normal_force**2 / spring.normal[pairs.kind]))
    return 0.5 * (normal + float(np.sum(pairs.shear_force**2 / spring.shear[pairs.kind])))
