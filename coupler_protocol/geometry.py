"""Plane geometry of closed loops of points."""

import numpy as np


def segment_vectors(nodes):
    """Vectors (K,2) from each node to the next along the closed loop [m]."""
    return np.roll(nodes, -1, axis=0) - nodes


def polygon_area(nodes):
    """Signed area [m2] of the loop, positive when it runs counter-clockwise."""
    following = np.roll(nodes, -1, axis=0)
    return 0.5 * float(np.sum(nodes[:, 0] * following[:, 1] - nodes[:, 1] * following[:, 0]))
