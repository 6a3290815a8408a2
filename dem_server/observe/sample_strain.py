"""Mean strain of a sample between walls: the affine motion that is nearest to the displacements u of its discs.

    u(X) = a + G X,   sum A (u_i - a - G X_i)^2 = min,   strain = (G + G^T) / 2        (1)

over the free discs, with their areas A and their places X when displacements were last set to zero. Unlike the motion of walls it
contains no deformation of the contacts with the walls, which are softer than the sample. Tension positive, small strain.
"""

import numpy as np


def mean_strain(model, state):
    """Strain xx, yy, xy (3,) [-] by Eq (1); NaN for discs on one line."""
    free = slice(model.ring, None)
    area = state.radius[free] ** 2
    place, moved = state.origin[free], state.displacement[free]
    place, moved = (a - area @ a / area.sum() for a in (place, moved))
    moment = (place * area[:, None]).T @ place
    if np.linalg.cond(moment) > 1e12:
        return np.full(3, np.nan)
    gradient = np.linalg.solve(moment, (place * area[:, None]).T @ moved).T
    return np.array([gradient[0, 0], gradient[1, 1], 0.5 * (gradient[0, 1] + gradient[1, 0])])
