"""Stress and strain of a window in bins as large as a zone, comparable to those of zones outside the window.

stress_ij = -1/A sum over contacts of branch_i force_j, with the branch from the first to the second body, a disc
or a rigid clump of discs, and the force on the second, tension positive (J. Christoffersen, M.M. Mehrabadi,
S. Nemat-Nasser, J. Appl. Mech. 48 (1981) 339-344).

Strain: coupler_protocol.criteria.strain_bins, which the discs also use while they compute.

Bins and positions are those at the start, as for zones: a disc or contact stays in its bin while the window
deforms.
"""

import numpy as np

from colluvium.results.rank_file import Fields
from colluvium.results.run import Run
from coupler_protocol.criteria import strain_bins
from coupler_protocol.criteria.strain_bins import Bins
from coupler_protocol.geometry import polygon_area

BRANCH_PARTS = (0.125, 0.375, 0.625, 0.875)  # middles of the quarters of a branch


def bins(run: Run, frame: int, rank: int = 1) -> Bins:
    """Bins as large as a zone (without zones: ten discs wide) over the outline of a window."""
    discs = run.discs(frame, rank)
    if run.has(frame, 0):
        length = zone_length(run.gridpoints(frame).xy, run.zones(frame).corners)
    else:
        length = 10.0 * 2.0 * float(np.median(discs.radius))
    return strain_bins.bins_over(outline_around(run, discs, rank), length)


def outline_of(run: Run, frame: int, rank: int = 1) -> np.ndarray:
    """(P, 2) corners of the window at the start [m]: the control discs in order, the scene's polygon, or a box."""
    return outline_around(run, run.discs(frame, rank), rank)


def outline_around(run: Run, discs: Fields, rank: int = 1) -> np.ndarray:
    """The same for the discs of a frame."""
    start = starting_places(discs)
    if "control" in discs and (discs.control == 1).sum() > 2:
        ring, surface = start[discs.control == 1], run.window_surface(rank)
        return ring if surface is None else np.concatenate([ring, surface])
    windows = run.scene.get("window") or []
    if rank <= len(windows) and windows[rank - 1].get("polygon"):
        corners = np.array(windows[rank - 1]["polygon"])
        return corners if polygon_area(corners) > 0.0 else corners[::-1]
    (x0, y0), (x1, y1) = start.min(axis=0), start.max(axis=0)
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])


def starting_places(discs: Fields) -> np.ndarray:
    """(n, 2) positions of the discs before any displacement [m]."""
    return discs.xy - discs.displacement


def body_centres(discs: Fields) -> tuple[np.ndarray, np.ndarray]:
    """(n, 2) centroid [m] of the body of each disc, its clump or the disc: now, and before any displacement."""
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
    """(B, 3) xx, yy, xy of the mean stress in each bin [Pa], tension positive; NaN in unused bins."""
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
    return strain_bins.shear(starting_places(discs), discs[field], grid)


def zone_length(xy: np.ndarray, corners: np.ndarray) -> float:
    """Square root [m] of the median area of zones (Z, 4) with gridpoints (N, 2) [m]."""
    a, b = xy[corners[:, 2]] - xy[corners[:, 0]], xy[corners[:, 3]] - xy[corners[:, 1]]
    # the area of a quadrilateral is half the cross product of its diagonals
    return float(np.sqrt(np.median(0.5 * np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]))))
