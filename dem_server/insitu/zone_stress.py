"""Stress of the zones that a window replaces: at any point, and its balance with the weight of the window.

    f = int sigma n ds - W e_y,   zero at rest                                   (1)

over the window's rim, n its outward normal, W its weight. No packing can keep a stress that does not fulfil (1): the discs move
until their stress fulfils it. "Zones" are rows x, y, area, xx, yy, xy, density; tension positive.
"""

import numpy as np
import scipy

from coupler_protocol.wire.payloads import PLACE, STRESS


def stress_field(target):
    """The zones' stresses (z, 7) as a function of points (m, 2), exact at centres and for linear fields."""
    xy = target[:, PLACE]
    plane = np.linalg.matrix_rank(xy - xy.mean(axis=0), tol=1e-9) == 2
    return scipy.interpolate.RBFInterpolator(
        xy, target[:, STRESS], neighbors=min(len(xy), 40), kernel="linear", degree=1 if plane else 0
    )


def tractions(rim, field):
    """Force (R, 2) [N] that the stress `field` exerts from outside on each piece of the closed chain `rim` (R, 2)."""
    along = np.roll(rim, -1, axis=0) - rim
    xx, yy, xy = field(rim + 0.5 * along).T
    normal = np.column_stack([along[:, 1], -along[:, 0]])  # outward, times length: the chain runs counter-clockwise
    return np.column_stack([xx * normal[:, 0] + xy * normal[:, 1], xy * normal[:, 0] + yy * normal[:, 1]])


def imbalance(rim, field, weight):
    """f of Eq (1) (2,) as a share of the `weight` [N]; without weight, as a share of the sum of the tractions."""
    force = tractions(rim, field)
    scale = weight if weight > 0.0 else np.hypot(*force.T).sum()
    return (force.sum(axis=0) - [0.0, weight]) / scale if scale > 0.0 else np.zeros(2)
