"""Strain of a window in bins as large as a zone, comparable to the strain of zones outside the window.

The displacement gradient G of a bin is the least-squares fit of its discs, u = u0 + G (x - x0). Bins and positions are those at
the start, as for zones: a disc stays in its bin while the window deforms.

The discs use this while they compute, and reports apply it to recorded frames: both have the same numbers.
"""

from typing import NamedTuple

import numpy as np
import shapely

FEWEST_DISCS = 6  # a gradient has 3 unknowns a direction; a fit with fewer than twice as many discs is unreliable
FULL = 0.5  # the part of a bin that must lie inside the window
NONE = -1.0  # in messages: the strain of a bin that has none


class Bins(NamedTuple):
    """Equal rectangles over the bounding box of a window; only those mostly inside it are used."""

    corner: np.ndarray  # (2,) lower left [m]
    size: np.ndarray  # (2,) [m]
    shape: tuple[int, int]  # columns, rows
    area: np.ndarray  # (B,) inside the window [m2]; bin = row * columns + column

    @property
    def used(self) -> np.ndarray:
        """(B,) bool: bins that are mostly inside the window."""
        return self.area >= FULL * self.size.prod()

    @property
    def rectangles(self) -> np.ndarray:
        """(B, 4, 2) corners, counter-clockwise."""
        rows, columns = np.divmod(np.arange(len(self.area)), self.shape[0])
        unit = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
        return self.corner + (np.column_stack((columns, rows))[:, None, :] + unit) * self.size

    @property
    def middles(self) -> np.ndarray:
        """(B, 2) [m]."""
        return self.rectangles.mean(axis=1)

    def of(self, xy: np.ndarray) -> np.ndarray:
        """(n,) bin of each point (n, 2); a point outside is in the nearest bin."""
        place = np.floor((xy - self.corner) / self.size).astype(np.int64)
        column, row = np.clip(place, 0, np.array(self.shape) - 1).T
        return row * self.shape[0] + column


def shape_over(outline: np.ndarray, length: float) -> tuple[int, int]:
    """Columns and rows of bins of about `length` [m] over the box around an outline (P, 2)."""
    columns, rows = np.maximum(np.rint(np.ptp(outline, axis=0) / length), 1).astype(int).tolist()
    return columns, rows


def bins_over(outline: np.ndarray, length: float) -> Bins:
    """Bins of about `length` [m] over the outline (P, 2) of a window."""
    low, high = outline.min(axis=0), outline.max(axis=0)
    shape = shape_over(outline, length)
    size = (high - low) / shape
    empty = Bins(low, size, shape, np.zeros(shape[0] * shape[1]))
    inside = shapely.intersection(shapely.polygons(empty.rectangles), shapely.Polygon(outline))
    return empty._replace(area=np.asarray(shapely.area(inside)))


def shear(xy: np.ndarray, values: np.ndarray, bins: Bins) -> np.ndarray:
    """(B,) largest engineering shear of each bin, or NaN, from `values` (n, 2) at points that were at xy (n, 2) at the start."""
    gradient = gradients(xy, values, bins)
    return np.hypot(gradient[:, 0, 0] - gradient[:, 1, 1], gradient[:, 0, 1] + gradient[:, 1, 0])


def gradients(xy: np.ndarray, values: np.ndarray, bins: Bins) -> np.ndarray:
    """(B, 2, 2) least-squares gradient d value_i / d x_j of each bin; NaN if it has too few points."""
    place, count = bins.of(xy), len(bins.area)

    def total(weights: np.ndarray) -> np.ndarray:
        return np.bincount(place, weights, count)

    number = np.maximum(total(np.ones(len(xy))), 1.0)
    x, v = (data - np.column_stack([total(c) / number for c in data.T])[place] for data in (xy, values))
    spread = np.array([[total(x[:, i] * x[:, j]) for j in range(2)] for i in range(2)]).transpose(2, 0, 1)
    moment = np.array([[total(v[:, i] * x[:, j]) for j in range(2)] for i in range(2)]).transpose(2, 0, 1)
    enough = bins.used & (number >= FEWEST_DISCS)
    gradient = np.full((count, 2, 2), np.nan)
    gradient[enough] = np.linalg.solve(spread[enough], moment[enough].swapaxes(1, 2)).swapaxes(1, 2)
    return gradient


def as_rows(xy: np.ndarray, values: np.ndarray, bins: Bins) -> np.ndarray:
    """(B, 3) centre x, y [m] and shear strain of each bin, NONE if it has none, as in messages."""
    found = shear(xy, values, bins)
    return np.column_stack((bins.middles, np.where(bins.used & np.isfinite(found), found, NONE)))


def from_rows(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Centres (b, 2) [m] and strains (b,) of the bins that have a strain."""
    there = rows[:, 2] >= 0.0
    return rows[there, :2], rows[there, 2]
