"""A coarse grid of overlapping bins: bilinear hat functions that sum to one everywhere in the window.

Averages over a hat and interpolation from the hats use the same weights, so measured and applied fields are
consistent, and no field jumps at the edge of a bin.
"""

from typing import NamedTuple

import numpy as np
import scipy
import shapely

FINE = 8  # quadrature points a bin side


class Bins(NamedTuple):
    """Grid of bins.

    Corner `low` (2,), spacing `size` (2,) [m], number of nodes `shape` (2,); quadrature `points` (q, 2)
    inside the window, each with the area `share` [m2].
    """

    low: np.ndarray
    size: np.ndarray
    shape: np.ndarray
    points: np.ndarray
    share: float

    def weights(self, xy):
        """Hat functions at points (m, 2): sparse (m, nodes), rows sum to one."""
        at = np.clip((xy - self.low) / self.size, 0.0, self.shape - 1.0)
        base = np.minimum(at.astype(np.int64), self.shape - 2)
        fx, fy = (at - base).T
        node = base[:, 1] * self.shape[0] + base[:, 0]
        columns = np.column_stack([node, node + 1, node + self.shape[0], node + self.shape[0] + 1])
        values = np.column_stack([(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy])
        rows = np.repeat(np.arange(len(xy)), 4)
        size = len(xy), int(self.shape.prod())
        return scipy.sparse.csr_array((values.ravel(), (rows, columns.ravel())), shape=size)

    def integral(self, values):
        """Integral of values (q, k) at the quadrature points over each hat: (nodes, k)."""
        return self.share * (self.weights(self.points).T @ values)

    def area(self):
        """Area of the window under each hat (nodes,) [m2]."""
        return self.integral(np.ones((len(self.points), 1)))[:, 0]


def bins_over(polygon, size):
    """Bins of about `size` [m] over a polygon (P, 2)."""
    low, high = polygon.min(axis=0), polygon.max(axis=0)
    cells = np.maximum(np.round((high - low) / size), 1).astype(np.int64)
    spacing = (high - low) / cells
    x, y = (low[k] + (np.arange(cells[k] * FINE) + 0.5) * spacing[k] / FINE for k in (0, 1))
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    points = points[shapely.contains_xy(shapely.Polygon(polygon), points)]
    share = shapely.Polygon(polygon).area / len(points)
    return Bins(low, spacing, cells + 1, points, share)
