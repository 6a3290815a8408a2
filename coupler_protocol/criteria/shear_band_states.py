"""States of the band at windows of discs: it enters a window, passes through it, is complete.

    enters     the band connects the toe with cells of a window
    through    .. with zones beyond the window
    complete   .. with the crest; in a grid without a hole: from toe to crest

A state is reached if the highest shear strain that still makes its connection is shear_band.COUNTED or more. A bin counts only if
its strain is at least twice the median of its window: a window softer than the zones shears everywhere before there is a band.
The band enters a window by the sides that face the toe and leaves it by those that face the crest. So each state includes the
earlier ones, and a band around the window is in none of them. Any of several windows counts; the band is not followed from one
window into another.
"""

from typing import NamedTuple

import numpy as np

from coupler_protocol.criteria.shear_band import COUNTED, Cells, Surface, bottleneck, nearest, toe_to_crest

ABOVE_MEDIAN = 2.0


class Levels(NamedTuple):
    """Highest shear strains that connect the toe with a window, with zones beyond the window, and through it with the crest."""

    enters: float
    through: float
    complete: float


def levels(found: Cells, surface: Surface) -> Levels:
    """Levels of the three connections; `found` must contain cells of windows."""
    strain, pairs, zones = _layers(found, surface)
    toe, crest = (nearest(found.xy[:zones], points) for points in surface)
    inside = np.arange(zones, len(found.xy))
    ends = (inside, _beyond(found, pairs), len(found.xy) + crest)
    return Levels(*(bottleneck(strain, pairs, toe, cells) for cells in ends))


def holds(state: str, found: Cells, surface: Surface) -> bool:
    """Whether a state ("enters", "through", "complete") is reached in these cells."""
    if not np.any(found.rank):
        return state == "complete" and toe_to_crest(found, surface) >= COUNTED
    return getattr(levels(found, surface), state) >= COUNTED


def _layers(found: Cells, surface: Surface) -> tuple[np.ndarray, np.ndarray, int]:
    """Strains and neighbours of a graph in which zones beyond a window are reached only through it; number of zones.

    The graph contains every zone twice: before the windows, where the toe is, and beyond them (after all cells). The neighbours
    of a bin are the first on sides that face the toe and the second on sides that face the crest.
    """
    zones, count = int((found.rank == 0).sum()), len(found.xy)
    strain = found.strain.copy()
    for rank in np.unique(found.rank[zones:]):
        own = found.rank == rank
        strain[own & (strain < ABOVE_MEDIAN * np.median(strain[own]))] = -1.0
    first, second = np.sort(found.pairs, axis=1).T
    outside, inner = second < zones, first >= zones
    zone, bin_ = first[~outside & ~inner], second[~outside & ~inner]
    uphill = surface.crest.mean(axis=0) - surface.toe.mean(axis=0)
    beyond = _offset(found, zone, bin_) @ uphill > 0.0
    pairs = np.concatenate(
        (
            found.pairs[outside],
            found.pairs[outside] + count,
            found.pairs[inner],
            np.column_stack((np.where(beyond, zone + count, zone), bin_)),
        )
    )
    return np.concatenate((strain, strain[:zones])), pairs, zones


def _offset(found: Cells, zone: np.ndarray, bin_: np.ndarray) -> np.ndarray:
    """(p, 2) direction from the window to each zone beside one of its bins: away from the nearest bin, also in notches."""
    from scipy.spatial import cKDTree

    away = np.zeros((len(zone), 2))
    for rank in np.unique(found.rank[bin_]):
        bins, own = found.xy[found.rank == rank], found.rank[bin_] == rank
        places = found.xy[zone[own]]
        away[own] = places - bins[cKDTree(bins).query(places)[1]]
    return away


def _beyond(found: Cells, pairs: np.ndarray) -> np.ndarray:
    """Zones beyond a window that are neighbours of one of its bins."""
    low, high = np.sort(pairs, axis=1).T
    count = len(found.xy)
    return np.unique(high[(high >= count) & (low < count)])
