"""Strain of a window in bins, which a FORCE contains after the forces if the continuum requests it."""

import math

import numpy as np

from coupler_protocol.criteria import strain_bins


def bins_over_box(nodes, length):
    """Number of bins of `length` [m] that a peer asks for in the box around nodes (K, 2), as a float; 0 for no length."""
    return math.prod(max(1.0, float(side) / length) for side in np.ptp(nodes, axis=0)) if length > 0.0 else 0.0


class WindowStrain:
    """Strain of a window in `bins` bins of about `length` [m].

    ring: number of control discs, the first of the state; surface (S, 2) [m]: as in Model.
    """

    def __init__(self, length, state, ring, surface=None):
        self.length, self.ring, self.surface = length, ring, surface
        columns, rows = strain_bins.shape_over(self._outline(self._start(state)), length)
        self.bins = columns * rows

    def measure(self, state):
        """Centre [m] and shear strain (B, 3) of each bin, with the same bits as a report computes from the frame of this step."""
        start = self._start(state)
        bins = strain_bins.bins_over(self._outline(start), self.length)
        return strain_bins.as_rows(start, state.displacement, bins)

    def _outline(self, start):
        """Corners (P, 2) [m] of the window at the start."""
        ring = start[: self.ring]
        return ring if self.surface is None else np.concatenate([ring, self.surface])

    @staticmethod
    def _start(state):
        return state.x - state.displacement
