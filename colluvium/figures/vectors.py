"""Displacement vectors of discs and gridpoints in and around the window, thinned to one for each cell of an even grid."""

from typing import Any

import numpy as np

from colluvium.figures import domain, frames, moments, style
from colluvium.results.run import Run
from colluvium.results.window_fields import outline_of

CELLS = 18  # cells along the longer side of a window, each with one arrow
MARGIN = 3  # cells around the window in which gridpoints are shown
LONGEST = 2.5  # cells: length of the arrow that 0.5 % of the arrows exceed
ZONES, SOIL, STONE, FILL = "#8c8c8c", "#123a5e", "#c0561f", "#efe8da"
KINDS = ((ZONES, "gridpoint"), (SOIL, "disc of soil"), (STONE, "disc of a stone"))


def missing(run: Run) -> str:
    """Text of the missing data: discs that have moved. "" if there are any."""
    if not run.windows:
        return "no frame of discs"
    return "" if _shown(run) else "no disc has moved"


@style.styled
def draw(run: Run) -> Any:
    """Draws the first window in each state of the band, or at the ends of the stages; arrows begin at the initial positions.

    Each panel has a separate scale, which its title gives.
    """
    from matplotlib.patches import Patch

    rank = run.windows[0]
    shown = _shown(run)
    outline = outline_of(run, shown[0].frame, rank)
    cell = float(np.ptp(outline, axis=0).max()) / CELLS
    figure, axes = domain.panels(len(shown), outline)
    for place, moment in zip(axes, shown, strict=True):
        longest = _draw_panel(run, moment.frame, rank, place, outline, cell)
        factor, unit = style.readable("m", np.array([longest]))
        state = moments.title(run, moment)
        domain.finish(place, f"{state}\nlongest arrow {factor * longest:.3g} {unit}")
    absent = {STONE} if not run.stones(rank) else set()
    absent |= {ZONES} if not run.recorded(0) else set()
    handles = [Patch(color=colour, label=words) for colour, words in KINDS if colour not in absent]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, title="displacement vectors")
    return figure


def _shown(run: Run) -> list[moments.Moment]:
    """Moments at which any disc has moved."""
    rank = run.windows[0]
    found = moments.of_run(run, rank, frames.last_of_stages)
    return [one for one in found if run.discs(one.frame, rank).displacement.any()]


def _draw_panel(run: Run, frame: int, rank: int, axes: Any, outline: np.ndarray, cell: float) -> float:
    """Draws arrows of a window and its surroundings; returns the displacement of the longest one [m]."""
    from matplotlib.collections import PolyCollection

    discs = run.discs(frame, rank)
    start = discs.xy - discs.displacement
    stone = discs.stone if "stone" in discs else np.full(len(start), -1)
    parts = [(start, discs.displacement, np.where(stone >= 0, STONE, SOIL))]
    if run.has(frame, 0):
        points = run.gridpoints(frame)
        near = _near(points.xy, outline, MARGIN * cell) & _in_use(run, frame)
        parts.append((points.xy[near], points.displacement[near], np.full(near.sum(), ZONES)))
    xy, moved, colour = (np.concatenate(part) for part in zip(*parts, strict=True))
    chosen = thinned(xy, cell)
    longest = max(style.limits(np.hypot(*moved[chosen].T))[1], np.finfo(float).tiny)
    if run.stones(rank):
        axes.add_collection(PolyCollection(run.stones(rank), facecolors=FILL, edgecolors=style.PALE, linewidths=0.4))
    axes.add_collection(PolyCollection([outline], facecolors="none", edgecolors=style.INK, linewidths=0.8))
    arrows = moved[chosen] * (LONGEST * cell / longest)
    axes.quiver(
        *xy[chosen].T,
        *arrows.T,
        color=colour[chosen],
        angles="xy",
        scale_units="xy",
        scale=1.0,
        units="xy",
        width=0.05 * cell,
        headwidth=4.0,
        headlength=5.0,
        minlength=0.0,
        minshaft=1.5,
        zorder=3,
    )
    room = (MARGIN + 1) * cell  # for arrows that begin in the margin
    domain.draw_walls(axes, run, frame)
    axes.update_datalim([outline.min(axis=0) - room, outline.max(axis=0) + room, *(xy[chosen] + arrows)])
    return longest


def thinned(xy: np.ndarray, cell: float) -> np.ndarray:
    """Indices of one point (n, 2) in each square of side `cell` [m]: the one nearest to the square's centre."""
    square = np.floor(xy / cell)
    off = np.hypot(*(xy / cell - square - 0.5).T)
    order = np.lexsort((off, square[:, 1], square[:, 0]))
    first = np.ones(len(xy), dtype=bool)
    first[1:] = (np.diff(square[order], axis=0) != 0).any(axis=1)
    return order[first]


def _near(xy: np.ndarray, outline: np.ndarray, margin: float) -> np.ndarray:
    """(n,) bool: points outside the bounding box of an outline, within `margin` [m]."""
    low, high = outline.min(axis=0), outline.max(axis=0)
    away = np.abs(xy - np.clip(xy, low, high)).max(axis=1)
    return (away > 1e-9) & (away <= margin)


def _in_use(run: Run, frame: int) -> np.ndarray:
    """(N,) bool: gridpoints that belong to a zone."""
    used = np.zeros(len(run.gridpoints(frame).xy), dtype=bool)
    used[run.zones(frame).corners] = True
    return used
