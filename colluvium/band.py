"""Has the slope failed, and does the band cross the window? A rule anyone can check on the recorded frames.

Cells are the zones and, inside windows, bins as large as zones (strain from the discs' displacements). The *level* of a frame
is the highest shear strain L such that cells strained by at least L connect the toe (ground surface in the lowest quarter of the
slope's height) with the crest (level ground on top). The slope counts as failed from the first frame whose level reaches
FAILED. The band crosses the windows where the level drops once their bins may not be used, else it goes round them.

Strains count from the end of the stage `equilibrium`; cells are neighbours when they share a corner.
"""

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from colluvium import window_fields
from colluvium.results import Run

FAILED = 0.01


class Level(NamedTuple):
    """Highest shear strain that connects toe and crest in one frame, and the same round the windows."""

    frame: int
    gravity_factor: float
    step: int
    through: float
    around: float

    @property
    def crosses(self) -> bool:
        """Whether the band needs the window."""
        return self.through > self.around


class Surface(NamedTuple):
    """Zones of the uncut grid that lie on the ground, by what their place on the slope is."""

    toe: np.ndarray  # (.., 2) their middles [m]
    crest: np.ndarray


class Cells(NamedTuple):
    """Zones and, behind them, the bins of the windows in one frame."""

    xy: np.ndarray  # (n, 2) middles at the start [m]
    strain: np.ndarray  # (n,) engineering shear strain
    rank: np.ndarray  # (n,) 0: a zone, else the window of the bin
    pairs: np.ndarray  # (p, 2) cells that share a corner


def levels(run: Run, stages: tuple[str, ...] = ("overload",)) -> list[Level]:
    """The level of every frame of the stages whose kind is one of `stages`."""
    kinds = {stage["name"]: stage["kind"] for stage in run.scene["stage"]}
    surface = ground(run)
    return [level(run, i, surface) for i, frame in enumerate(run.frames) if kinds[frame.stage] in stages and run.has(i, 0)]


def failure(found: list[Level], threshold: float = FAILED) -> Level | None:
    """The first level that counts as failed, or None."""
    return next((one for one in found if one.through >= threshold), None)


def summary(run: Run, threshold: float = FAILED) -> dict | None:
    """The rule's answer for run.json and the closing table; None where no frame of an overload was recorded."""
    found = levels(run)
    if not found:
        return None
    failed = failure(found, threshold)
    shown = failed or found[-1]
    before = found[found.index(failed) - 1] if failed and failed is not found[0] else None
    return {
        "threshold": threshold,
        "failed_at": failed.gravity_factor if failed else None,
        "not_failed_at": before.gravity_factor if failed and before else None if failed else shown.gravity_factor,
        "step": shown.step,
        "level_through": shown.through,
        "level_around": shown.around,
        "crosses_window": shown.crosses,
    }


def in_words(found: dict) -> str:
    """One sentence or two on the answer of `summary`."""
    level = f"level {100 * found['level_through']:.2g} %, round the window {100 * found['level_around']:.2g} %"
    if found["failed_at"] is None:
        band = f"no band of {100 * found['threshold']:g} % shear strain"
        return f"not failed up to {found['not_failed_at']:.2f} g: {band} ({level})"
    since = f" (not yet at {found['not_failed_at']:.2f} g)" if found["not_failed_at"] is not None else ""
    way = "through the window" if found["crosses_window"] else "round the window"
    return (
        f"failed at {found['failed_at']:.2f} g{since}: from there on a band of {100 * found['threshold']:g} % shear strain "
        f"connects toe and crest, {way} ({level})"
    )


def ground(run: Run) -> Surface:
    """Toe and crest from the first frame, whose grid has no hole yet."""
    zones, xy = run.zones(0), run.gridpoints(0).xy
    edges = np.stack((zones.corners, np.roll(zones.corners, -1, axis=1)), axis=2)
    owner = np.repeat(np.arange(len(edges)), 4)
    edges = edges.reshape(-1, 2)
    real = edges[:, 0] != edges[:, 1]
    edges, owner = edges[real], owner[real]
    _, where, count = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True)
    outer = count[where.ravel()] == 1
    a, b = xy[edges[outer, 0]], xy[edges[outer, 1]]
    owner = owner[outer]
    upward = b[:, 0] < a[:, 0] - 1e-9  # counter-clockwise zones: the ground runs from right to left
    height = 0.5 * (a[:, 1] + b[:, 1])
    low, high = height[upward].min(), height[upward].max()
    level_ground = np.abs(a[:, 1] - b[:, 1]) < 1e-9
    toe = upward & (height <= low + 0.25 * (high - low))
    crest = upward & level_ground & (height >= high - 1e-9)
    return Surface(zones.xy[np.unique(owner[toe])], zones.xy[np.unique(owner[crest])])


def level(run: Run, frame: int, surface: Surface) -> Level:
    """The level of one frame."""
    found = cells(run, frame)
    toe, crest = nearest(found.xy, surface.toe), nearest(found.xy, surface.crest)
    info = run.frames[frame]
    through = bottleneck(found.strain, found.pairs, toe, crest)
    around = bottleneck(np.where(found.rank > 0, -1.0, found.strain), found.pairs, toe, crest)
    return Level(frame, info.gravity_factor, info.step, through, around)


def cells(run: Run, frame: int) -> Cells:
    """Zones and bins of one frame, and which of them share a corner: middles within one and a half cells each way."""
    zones = run.zones(frame)
    middles, strain, ranks = [zones.xy], [zones.shear_strain], [0]
    for rank in run.windows:
        if run.has(frame, rank):
            bins = window_fields.bins(run, frame, rank)
            inside = window_fields.shear_strain(run, frame, bins, rank)
            use = bins.used & np.isfinite(inside)
            middles.append(bins.rectangles[use].mean(axis=1))
            strain.append(inside[use])
            ranks.append(rank)
    xy = np.concatenate(middles)
    pairs = cKDTree(xy / _cell_size(run, frame)).query_pairs(1.5, output_type="ndarray")
    return Cells(xy, np.concatenate(strain), np.repeat(ranks, [len(part) for part in middles]), pairs)


def _cell_size(run: Run, frame: int) -> np.ndarray:
    corners = run.gridpoints(frame).xy[run.zones(frame).corners]
    return np.median(np.ptp(corners, axis=1), axis=0)


def nearest(xy: np.ndarray, points: np.ndarray) -> np.ndarray:
    """The cells, by their middles (n, 2), that lie nearest to the points (m, 2)."""
    return np.unique(cKDTree(xy).query(points)[1])


def bottleneck(strain: np.ndarray, pairs: np.ndarray, starts: np.ndarray, ends: np.ndarray) -> float:
    """The highest of the strains that still connects one of `starts` with one of `ends` (0 where nothing does)."""
    values = np.unique(strain[strain >= 0.0])
    low, high = -1, len(values)  # values[low] connects, values[high] does not
    while high - low > 1:
        middle = (low + high) // 2
        if _connected(strain >= values[middle], pairs, starts, ends):
            low = middle
        else:
            high = middle
    return float(values[low]) if low >= 0 else 0.0


def _connected(chosen: np.ndarray, pairs: np.ndarray, starts: np.ndarray, ends: np.ndarray) -> bool:
    kept = pairs[chosen[pairs].all(axis=1)]
    graph = coo_array((np.ones(len(kept), dtype=bool), kept.T), shape=(len(chosen), len(chosen)))
    piece = connected_components(graph, directed=False)[1]
    return bool(np.intersect1d(piece[starts[chosen[starts]]], piece[ends[chosen[ends]]]).size)
