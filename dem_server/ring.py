"""Geometry of the ring: the closed counter-clockwise chain of control discs around a window."""

import numpy as np


def inner_share(ring_xy):
    """Share of each control disc's area inside the ring (R,): the chain's interior angle over a full turn."""
    ahead = np.roll(ring_xy, -1, axis=0) - ring_xy
    back = np.roll(ring_xy, 1, axis=0) - ring_xy
    cross = ahead[:, 0] * back[:, 1] - ahead[:, 1] * back[:, 0]
    return np.mod(np.arctan2(cross, (ahead * back).sum(axis=1)), 2.0 * np.pi) / (2.0 * np.pi)
