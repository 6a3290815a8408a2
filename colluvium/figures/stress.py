"""Stress before and after discs replace zones, and the change between the two.

Stresses of zones are averaged at gridpoints, because single zones can alternate about the stress (docs/theory.md); `draw` with
`by_zone` draws the stresses of the zones as computed.
"""

from typing import Any, NamedTuple

import numpy as np

from colluvium.figures import domain, style
from colluvium.results.run import Run
from colluvium.results.window_fields import bins, mean_stress

TITLES = {False: "zones: stress averaged at gridpoints", True: "zones: stress of each zone"}  # by by_zone
COMPONENTS = (("syy", "vertical stress", 1), ("sxx", "horizontal stress", 0))


class Cells(NamedTuple):
    """Zones and bins: corners (n, 4, 2) [m] and one stress component (n,) [Pa]."""

    corners: np.ndarray
    stress: np.ndarray


def missing(run: Run) -> str:
    """Text of the missing data: a continuum. "" if there is one."""
    return "" if run.recorded(0) else "no frame of the continuum"


def moments(run: Run) -> tuple[int, int]:
    """The last frame without discs at the same gravity, and the last frame of the couple stage, after which discs act."""
    own = [i for i in range(len(run.frames)) if run.has(i, 0)]
    both = [i for i in own if any(run.has(i, rank) for rank in run.windows)]
    if not both:
        return own[0], own[-1]
    first = run.frames[both[0]]
    alone = [i for i in own if i < both[0] and run.frames[i].gravity_factor == first.gravity_factor]
    coupled = [i for i in both if run.frames[i].stage in run.stages_where(couples=True)] or both
    return alone[-1] if alone else both[0], coupled[-1]


@style.styled
def draw(run: Run, by_zone: bool = False) -> Any:
    """Draws rows for vertical and horizontal stress. Columns: before, after (in one colour scale), change."""
    import matplotlib.pyplot as plt

    frames = moments(run)
    figure, axes = plt.subplots(2, 3, figsize=(style.PAGE, 4.4), sharex=True, sharey=True, layout="compressed")
    figure.suptitle(TITLES[by_zone], x=0.01, ha="left")
    for row, (symbol, name, component) in zip(axes, COMPONENTS, strict=True):
        before, after = (_cells(run, frame, component, by_zone) for frame in frames)
        change = Cells(after.corners, after.stress - _at_same_places(before, after))
        factor, unit = style.readable("Pa", before.stress, after.stress)
        scale = style.limits(factor * before.stress, factor * after.stress)
        extreme = max(map(abs, style.limits(factor * change.stress)))
        for place, cells, colours, clim in (
            (row[0], before, "stress", scale),
            (row[1], after, "stress", scale),
            (row[2], change, "change", (-extreme, extreme)),
        ):
            filled = domain.fill_polygons(place, cells.corners, factor * cells.stress, cmap=style.colour_map(colours))
            filled.set_clim(clim)
            if place is not row[0]:
                bar = row[:2] if place is row[1] else place
                words = "change of " if place is row[2] else ""
                domain.colour_bar(figure, filled, bar, f"{words}{symbol} [{unit}]\ntension +", extend="both")
        for place, frame in zip(row, (*frames, frames[1]), strict=True):
            domain.outline(place, run.gridpoints(frame).xy, run.zones(frame).corners)
            domain.finish(place, f"{name}: {style.moment(run.frames[frame])}")
        row[2].set_title(f"{name}: change between the two")
    return figure


def _cells(run: Run, frame: int, component: int, by_zone: bool) -> Cells:
    """Bins of windows, and over them zones at a frame, because bins may reach beyond an oblique rim."""
    zones, parts = run.zones(frame), []
    for rank in run.windows:
        if run.has(frame, rank):
            grid = bins(run, frame, rank)
            inside = mean_stress(run, frame, grid, rank)[:, component]
            parts.append(Cells(grid.rectangles[grid.used], inside[grid.used]))
    stress = zones.stress if by_zone else run.smoothed_stress(frame)
    parts.append(Cells(run.gridpoints(frame).xy[zones.corners], stress[:, component]))
    return Cells(*(np.concatenate(part) for part in zip(*parts, strict=True)))


def _at_same_places(there: Cells, here: Cells) -> np.ndarray:
    """Stress (n,) [Pa] of the nearest cell of `there` at each cell of `here`."""
    from scipy.spatial import cKDTree

    _, nearest = cKDTree(there.corners.mean(axis=1)).query(here.corners.mean(axis=1))
    return there.stress[nearest]
