"""Stress and strain inside a window, in bins as large as a zone: what zones show outside it.

stress_ij = -1/A sum over contacts of branch_i force_j, with the branch from the first to the second body, a disc
or a rigid clump of discs, and the force on the second, tension positive (J. Christoffersen, M.M. Mehrabadi,
S. Nemat-Nasser, J. Appl. Mech. 48 (1981) 339-344).

Strain: the displacement gradient G that fits the discs of a bin best (least squares, u = u0 + G (x - x0)).

Bins and places are those at the start, as the zones' are: a disc or contact stays in its bin while the window
deforms.
"""

from typing import NamedTuple

import numpy as np
import shapely

from colluvium.rank_file import Fields
from colluvium.results import Run

FEWEST_DISCS = 6  # a gradient has 3 unknowns a direction; fewer than twice as many discs say little
BRANCH_PARTS = (0.125, 0.375, 0.625, 0.875)  # points along a branch that stand for a quarter of it each
FULL = 0.5  # the part of a bin that must lie inside the window


class Bins(NamedTuple):
    """Equal rectangles over the bounding box of a window; only those mostly inside it are used."""

    corner: np.ndarray  # (2,) lower left [m]
    size: np.ndarray  # (2,) [m]
    shape: tuple[int, int]  # columns, rows
    area: np.ndarray  # (B,) inside the window [m2]; bin = row * columns + column

    @property
    def used(self) -> np.ndarray:
        """(B,) bool: bins that lie mostly inside the window."""
        return self.area >= FULL * self.size.prod()

    @property
    def rectangles(self) -> np.ndarray:
        """(B, 4, 2) corners, counter-clockwise."""
        rows, columns = np.divmod(np.arange(len(self.area)), self.shape[0])
        unit = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
        return self.corner + (np.column_stack((columns, rows))[:, None, :] + unit) * self.size

    def of(self, xy: np.ndarray) -> np.ndarray:
        """(n,) the bin of each point (n, 2); points outside go to the nearest bin."""
        place = np.floor((xy - self.corner) / self.size).astype(np.int64)
        column, row = np.clip(place, 0, np.array(self.shape) - 1).T
        return row * self.shape[0] + column


def bins(run: Run, frame: int, rank: int = 1) -> Bins:
    """Bins as large as a zone (without zones: ten discs wide) over the outline of a window."""
    outline = shapely.Polygon(outline_of(run, frame, rank))
    low, high = np.reshape(outline.bounds, (2, 2))
    columns, rows = np.maximum(np.rint((high - low) / _bin_length(run, frame, rank)), 1).astype(int).tolist()
    size = (high - low) / (columns, rows)
    empty = Bins(low, size, (columns, rows), np.zeros(columns * rows))
    return empty._replace(area=shapely.area(shapely.intersection(shapely.polygons(empty.rectangles), outline)))


def outline_of(run: Run, frame: int, rank: int = 1) -> np.ndarray:
    """(P, 2) corners of the window at the start: the control discs in their order, or a box."""
    discs = run.discs(frame, rank)
    start = starting_places(discs)
    if "control" in discs and (discs.control == 1).sum() > 2:
        return start[discs.control == 1]
    (x0, y0), (x1, y1) = start.min(axis=0), start.max(axis=0)
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])


def starting_places(discs: Fields) -> np.ndarray:
    """(n, 2) where the discs were before any displacement [m]."""
    return discs.xy - discs.displacement


def body_centres(discs: Fields) -> tuple[np.ndarray, np.ndarray]:
    """(n, 2) centroid of the body each disc belongs to, itself or its clump: now, and before any displacement."""
    start = starting_places(discs)
    if "centroid" not in discs:
        return discs.xy, start
    own = discs.stone >= 0
    stone = discs.stone[own]
    number = np.maximum(np.bincount(stone), 1)
    moved = np.column_stack([np.bincount(stone, u) / number for u in discs.displacement[own].T])
    start[own] = discs.centroid[own] - moved[stone]
    return discs.centroid, start


def mean_stress(run: Run, frame: int, grid: Bins, rank: int = 1) -> np.ndarray:
    """(B, 3) xx, yy, xy of the mean stress in each bin [Pa], tension positive; NaN in bins not used."""
    discs, contacts = run.discs(frame, rank), run.contacts(frame, rank)
    branch = np.diff(discs.xy[contacts.ends], axis=1)[:, 0]
    body, start = body_centres(discs)
    span = np.diff(body[contacts.ends], axis=1)[:, 0]
    first, second = start[contacts.ends].swapaxes(0, 1)
    normal = branch / np.linalg.norm(branch, axis=1, keepdims=True)
    tangent = np.column_stack((-normal[:, 1], normal[:, 0]))
    force = contacts.normal_force[:, None] * normal
    if "shear_force" in contacts:
        force += contacts.shear_force[:, None] * tangent
    moments = (
        span[:, 0] * force[:, 0],
        span[:, 1] * force[:, 1],
        0.5 * (span[:, 0] * force[:, 1] + span[:, 1] * force[:, 0]),
    )
    sums = np.zeros((len(grid.area), 3))
    for part in BRANCH_PARTS:  # a branch over two bins counts in both
        place = grid.of((1.0 - part) * first + part * second)
        sums += np.column_stack([np.bincount(place, moment, len(grid.area)) for moment in moments])
    area = np.where(grid.used, grid.area, np.nan)
    return -sums / len(BRANCH_PARTS) / area[:, None]


def shear_strain(run: Run, frame: int, grid: Bins, rank: int = 1, field: str = "displacement") -> np.ndarray:
    """(B,) maximum engineering shear strain in each bin (`field="velocity"`: its rate), or NaN."""
    discs = run.discs(frame, rank)
    gradient = _gradients(starting_places(discs), discs[field], grid)
    return np.hypot(gradient[:, 0, 0] - gradient[:, 1, 1], gradient[:, 0, 1] + gradient[:, 1, 0])


def _gradients(xy: np.ndarray, values: np.ndarray, grid: Bins) -> np.ndarray:
    """(B, 2, 2) least-squares gradient d value_i / d x_j of each bin; NaN where there are too few points."""
    place, count = grid.of(xy), len(grid.area)

    def total(weights: np.ndarray) -> np.ndarray:
        return np.bincount(place, weights, count)

    number = np.maximum(total(np.ones(len(xy))), 1.0)
    x, v = (data - np.column_stack([total(c) / number for c in data.T])[place] for data in (xy, values))
    spread = np.array([[total(x[:, i] * x[:, j]) for j in range(2)] for i in range(2)]).transpose(2, 0, 1)
    moment = np.array([[total(v[:, i] * x[:, j]) for j in range(2)] for i in range(2)]).transpose(2, 0, 1)
    enough = grid.used & (number >= FEWEST_DISCS)
    gradient = np.full((count, 2, 2), np.nan)
    gradient[enough] = np.linalg.solve(spread[enough], moment[enough].swapaxes(1, 2)).swapaxes(1, 2)
    return gradient


def _bin_length(run: Run, frame: int, rank: int) -> float:
    if run.has(frame, 0):
        zones, xy = run.zones(frame), run.gridpoints(frame).xy
        return float(np.sqrt(np.median(shapely.area(shapely.polygons(xy[zones.corners])))))
    return 10.0 * 2.0 * float(np.median(run.discs(frame, rank).radius))
