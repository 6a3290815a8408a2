"""Displacement across the rim of a window in the last frame of a run."""

import numpy as np


def discs_that_move_with_gridpoints(run, rank=1):
    """Number of control discs of a window that sit on gridpoints; asserts that each has moved with its own."""
    grid, discs = run.gridpoints(-1), run.discs(-1, rank)
    start, on_node = discs.xy - discs.displacement, 0
    for xy, moved in zip(start[discs.control == 1], discs.displacement[discs.control == 1], strict=True):
        nearest = np.argmin(np.hypot(*(grid.xy - xy).T))
        if np.hypot(*(grid.xy[nearest] - xy)) < 1e-9:
            on_node += 1
            np.testing.assert_allclose(moved, grid.displacement[nearest], atol=1e-12)
    return on_node
