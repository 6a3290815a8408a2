"""Loading of libraries while the discs wait until the grid is built.

A window needs parts of SciPy for stones, radii and stress, and numba prepares its own tables before its first kernel. Together
this takes about as long as the grid needs until it welcomes the discs.
"""

from importlib import import_module

import numpy as np

from dem_server.model import X, Y
from dem_server.step.contact_pass import farthest

PARTS = ("scipy.special", "scipy.sparse.csgraph", "scipy.spatial", "scipy.optimize", "scipy.interpolate")


def libraries():
    """Yields after each library; the last piece loads a kernel, which every step calls."""
    for name in PARTS:
        import_module(name)
        yield
    farthest(np.zeros((1, max(X, Y) + 1)), np.zeros((1, 2)))
    yield
