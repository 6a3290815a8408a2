"""The band of a slope: cells that are strained so much that they connect its toe with its crest.

Cells are the zones and, inside windows, bins as large as zones. The *toe* is the ground in the lowest quarter of the slope's
height, the *crest* the level ground on top. Cells are neighbours when they share a corner. The *level* of a connection is the
highest shear strain L such that cells strained by at least L make it; a band counts if its level is COUNTED or more.

The continuum ends stages by this rule, and reports apply the same rule to recorded frames.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

COUNTED = 0.01


class Surface(NamedTuple):
    """Zones of the uncut grid at the ground surface of toe and crest."""

    toe: np.ndarray  # (.., 2) centres [m]
    crest: np.ndarray


class Cells(NamedTuple):
    """Zones and, after them, the bins of the windows at one moment."""

    xy: np.ndarray  # (n, 2) centres at the start [m]
    strain: np.ndarray  # (n,) engineering shear strain
    rank: np.ndarray  # (n,) 0 for a zone, else the window of the bin
    pairs: np.ndarray  # (p, 2) cells that share a corner


def middles(xy: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Mean (Z, 2) of each zone's distinct corners [m]; a triangle (Z, 4) repeats its third."""
    weight = np.full(corners.shape, 0.25)
    weight[corners[:, 2] == corners[:, 3]] = (1 / 3, 1 / 3, 1 / 3, 0.0)
    return np.einsum("zc,zcd->zd", weight, xy[corners])


def ground(xy: np.ndarray, corners: np.ndarray) -> Surface:
    """Toe and crest of a grid that has no hole yet: gridpoints (N, 2) [m], zones (Z, 4) counter-clockwise."""
    edges = np.stack((corners, np.roll(corners, -1, axis=1)), axis=2)
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
    centre = middles(xy, corners)
    return Surface(centre[np.unique(owner[toe])], centre[np.unique(owner[crest])])


def cells(
    xy: np.ndarray, corners: np.ndarray, strain: np.ndarray, windows: Sequence[tuple[int, np.ndarray, np.ndarray]] = ()
) -> Cells:
    """Cells of zones (A, 4) with gridpoints (N, 2) [m] and strains (A,), and of windows: (rank, centres (b, 2), strains (b,)).

    Two cells share a corner if the distance of their centres is at most one and a half cells in x and in y.
    """
    from scipy.spatial import cKDTree  # imported only where a band is computed, because it loads slowly

    size = np.median(np.ptp(xy[corners], axis=1), axis=0)
    parts = [(0, middles(xy, corners), strain), *windows]
    places = np.concatenate([part[1] for part in parts])
    pairs = cKDTree(places / size).query_pairs(1.5, output_type="ndarray")
    rank = np.repeat([part[0] for part in parts], [len(part[2]) for part in parts])
    return Cells(places, np.concatenate([part[2] for part in parts]), rank, pairs)


def toe_to_crest(found: Cells, surface: Surface, without: np.ndarray | None = None) -> float:
    """Level of the connection between toe and crest; `without` (n,): cells that may not be used."""
    return levels(found, surface, without)[0]


def levels(found: Cells, surface: Surface, *without: np.ndarray | None) -> list[float]:
    """Levels of the connection between toe and crest, one for each of `without`, as in `toe_to_crest`."""
    toe, crest = (nearest(found.xy, points) for points in surface)
    strains = (found.strain if cells is None else np.where(cells, -1.0, found.strain) for cells in without)
    return [bottleneck(strain, found.pairs, toe, crest) for strain in strains]


def nearest(xy: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Numbers of the cells with centres (n, 2) that are nearest to the points (m, 2)."""
    from scipy.spatial import cKDTree

    return np.unique(cKDTree(xy).query(points)[1])


def bottleneck(strain: np.ndarray, pairs: np.ndarray, starts: np.ndarray, ends: np.ndarray) -> float:
    """Highest of the strains that still connects one of `starts` with one of `ends` (0 if none does).

    A link is as strong as the weaker of its two cells. Links join pieces, the strongest first, until starts and ends are in one
    piece (J.B. Kruskal, Proc. Am. Math. Soc. 7 (1956) 48-50): the last link has the strain.
    """
    cells = len(strain)
    start, end = cells, cells + 1  # two further cells, linked to all starts and to all ends
    outer = [np.column_stack((own, np.full(len(own), cell))) for own, cell in ((starts, start), (ends, end))]
    first, second = np.concatenate((pairs, *outer)).T
    of_cells = np.append(strain, [np.inf, np.inf])
    strength = np.minimum(of_cells[first], of_cells[second])
    order = np.argsort(-strength)
    order = order[strength[order] >= 0.0]
    towards = list(range(cells + 2))  # of each cell, a later one of its piece, or itself: start and end are last until they join
    for a, b, reached in zip(first[order].tolist(), second[order].tolist(), strength[order].tolist(), strict=True):
        while a != towards[a]:
            towards[a] = a = towards[towards[a]]
        while b != towards[b]:
            towards[b] = b = towards[towards[b]]
        if a > b:
            a, b = b, a
        towards[a] = b
        if a == start and b == end:
            return reached
    return 0.0
