"""How far the band has come beside windows of discs: it enters one, is through it, is complete.

    enters     it connects the toe with cells of a window
    through    on to zones beyond the window
    complete   on to the crest; in a grid without a hole: from toe to crest

A state holds where the highest shear strain that still makes its connection is band.COUNTED or more. A bin counts only where it
is strained twice as much as the window's median, for a window softer than the zones shears everywhere before there is a band. The
band comes in by the sides of a window that face the toe and goes out by those that face the crest, so each state includes the
ones before it, and a band that goes round the window is none of them. Of several windows any counts; from one on into another it
is not followed.
"""

from typing import NamedTuple

import numpy as np

from coupler_protocol.criteria.shear_band import COUNTED, Cells, Surface, bottleneck, nearest, toe_to_crest

ABOVE_MEDIAN = 2.0


class Levels(NamedTuple):
    """Highest shear strains that connect the toe with a window, with the zones beyond it, and through it with the crest."""

    enters: float
    through: float
    complete: float


def levels(found: Cells, surface: Surface) -> Levels:
    """The levels of the three connections of cells that have windows among them."""
    strain, pairs, zones = _layers(found, surface)
    toe, crest = (nearest(found.xy[:zones], points) for points in surface)
    inside = np.arange(zones, len(found.xy))
    ends = (inside, _beyond(found, pairs), len(found.xy) + crest)
    return Levels(*(bottleneck(strain, pairs, toe, cells) for cells in ends))


def holds(state: str, found: Cells, surface: Surface) -> bool:
    """Whether a state ("enters", "through", "complete") holds in these cells."""
    if not np.any(found.rank):
        return state == "complete" and toe_to_crest(found, surface) >= COUNTED
    return getattr(levels(found, surface), state) >= COUNTED


def _layers(found: Cells, surface: Surface) -> tuple[np.ndarray, np.ndarray, int]:
    """Strains and neighbours of a graph in which what lies beyond a window is reached through it only; number of zones.

    Every zone stands there twice: before the windows, where the toe is, and beyond them (behind all cells). A bin has
    the first as neighbours on sides that face the toe, the second on sides that face the crest.
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
    """(p, 2) which way each zone lies outside the window of the bin beside it: away from the nearest bin, in notches too."""
    from scipy.spatial import cKDTree

    away = np.zeros((len(zone), 2))
    for rank in np.unique(found.rank[bin_]):
        bins, own = found.xy[found.rank == rank], found.rank[bin_] == rank
        places = found.xy[zone[own]]
        away[own] = places - bins[cKDTree(bins).query(places)[1]]
    return away


def _beyond(found: Cells, pairs: np.ndarray) -> np.ndarray:
    """The zones beyond a window that one of its bins has as neighbours."""
    low, high = np.sort(pairs, axis=1).T
    count = len(found.xy)
    return np.unique(high[(high >= count) & (low < count)])
