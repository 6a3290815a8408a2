"""Displacement vectors of discs and gridpoints in and around the window, thinned to one for each cell of an even grid."""

from typing import Any, NamedTuple

import numpy as np

from colluvium.figures import domain, frames, moments, style
from colluvium.results.run import Run
from colluvium.results.window_fields import outline_of

CELLS = 18  # cells along the longer side of a window, each with one arrow
MARGIN = 3  # cells around the window in which gridpoints are shown
LONGEST = 2.5  # cells: length of the arrow that 0.5 % of the arrows exceed
KEY_ROWS = 1.5  # cells between the arrows of the key
ZONES, SOIL, STONE, FILL = "#8c8c8c", "#123a5e", "#c0561f", "#efe8da"
KINDS = ((ZONES, "gridpoint"), (SOIL, "disc of soil"), (STONE, "disc of a stone"))


def missing(run: Run, rank: int | None = None) -> str:
    """Text of the missing data: discs that have moved. "" if there are any."""
    if not run.windows:
        return "no frame of discs"
    return "" if _shown(run, run.windows[0] if rank is None else rank) else "no disc has moved"


@style.styled
def draw(run: Run, rank: int | None = None) -> Any:
    """Draws a window (none: the first) in each state of the band, or at the ends of stages; arrows begin at initial positions.

    One logarithmic scale for all panels, with a key in the first: length = LONGEST (1 + log10(u/U) / D) cells, with U the longest
    displacement of all panels and D so many decades that the longest of no panel is shorter than one decade.
    """
    from matplotlib.patches import Patch

    rank = run.windows[0] if rank is None else rank
    shown = _shown(run, rank)
    outline = outline_of(run, shown[0].frame, rank)
    cell = float(np.ptp(outline, axis=0).max()) / CELLS
    figure, axes = domain.panels(len(shown), outline)
    arrows = [_arrows(run, moment.frame, rank, outline, cell) for moment in shown]
    scale = Scale.of([one.moved for one in arrows], LONGEST * cell)
    for place, moment, one in zip(axes, shown, arrows, strict=True):
        _draw_panel(run, moment.frame, rank, place, outline, one, scale, cell)
        domain.finish(place, moments.title(run, moment))
    _draw_key(axes[0], outline, scale, cell)
    absent = {STONE} if not run.stones(rank) else set()
    absent |= {ZONES} if not run.recorded(0) else set()
    handles = [Patch(color=colour, label=words) for colour, words in KINDS if colour not in absent]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, title="displacement vectors")
    return figure


def _shown(run: Run, rank: int) -> list[moments.Moment]:
    """Moments at which any disc of a window has moved."""
    found = moments.of_run(run, rank, frames.last_of_stages)
    return [one for one in found if run.discs(one.frame, rank).displacement.any()]


class Arrows(NamedTuple):
    """Arrows of one panel: begin (n, 2) [m], displacement (n, 2) [m], colour (n,)."""

    xy: np.ndarray
    moved: np.ndarray
    colour: np.ndarray


class Scale(NamedTuple):
    """Logarithmic scale of lengths: `longest` [m] is drawn as `drawn` [m], and `decades` below it as nothing."""

    longest: float
    decades: int
    drawn: float

    @classmethod
    def of(cls, displacements: list[np.ndarray], drawn: float) -> "Scale":
        """Scale for the displacements (n, 2) [m] of all panels."""
        largest = [max(style.limits(np.hypot(*moved.T))[1], np.finfo(float).tiny) for moved in displacements]
        return cls(max(largest), 1 + max(1, int(np.ceil(np.log10(max(largest) / min(largest)) - 1e-9))), drawn)

    def lengths(self, size: np.ndarray) -> np.ndarray:
        """Drawn lengths [m] of displacements of this size [m]; not longer than `drawn`."""
        with np.errstate(divide="ignore"):
            return self.drawn * np.clip(1.0 + np.log10(size / self.longest) / self.decades, 0.0, 1.0)

    def of_vectors(self, moved: np.ndarray) -> np.ndarray:
        """Drawn arrows (n, 2) [m] of displacements (n, 2) [m]."""
        size = np.hypot(*moved.T)
        return moved * (self.lengths(size) / np.maximum(size, np.finfo(float).tiny))[:, None]


def _arrows(run: Run, frame: int, rank: int, outline: np.ndarray, cell: float) -> Arrows:
    """Thinned arrows of a window and its surroundings in a frame."""
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
    return Arrows(xy[chosen], moved[chosen], colour[chosen])


def _draw_panel(
    run: Run, frame: int, rank: int, axes: Any, outline: np.ndarray, arrows: Arrows, scale: Scale, cell: float
) -> None:
    """Draws stones, outline, walls and arrows of a window and its surroundings."""
    from matplotlib.collections import PolyCollection

    if run.stones(rank):
        axes.add_collection(PolyCollection(run.stones(rank), facecolors=FILL, edgecolors=style.PALE, linewidths=0.4))
    axes.add_collection(PolyCollection([outline], facecolors="none", edgecolors=style.INK, linewidths=0.8))
    drawn = scale.of_vectors(arrows.moved)
    _quiver(axes, arrows.xy, drawn, arrows.colour, cell)
    domain.draw_walls(axes, run, frame)
    room = (MARGIN + 1) * cell  # for arrows that begin in the margin
    axes.update_datalim([outline.min(axis=0) - room, outline.max(axis=0) + room, *(arrows.xy + drawn)])


def _draw_key(axes: Any, outline: np.ndarray, scale: Scale, cell: float) -> None:
    """Draws an arrow for each decade of the scale below the drawing, with its displacement."""
    sizes = scale.longest * 10.0 ** -np.arange(scale.decades)
    low = axes.dataLim.y0
    begin = np.column_stack((np.full(len(sizes), outline[:, 0].min()), low - KEY_ROWS * cell * (1.0 + np.arange(len(sizes)))))
    drawn = np.column_stack((scale.lengths(sizes), np.zeros(len(sizes))))
    _quiver(axes, begin, drawn, style.INK, cell).set_gid("key")
    for (x, y), size in zip(begin, sizes, strict=True):
        factor, unit = style.readable("m", np.array([size]))
        axes.annotate(f"{factor * size:.3g} {unit}", (x + (LONGEST + 0.5) * cell, y), va="center", fontsize=style.SMALLEST)
    axes.update_datalim([(begin[0, 0], begin[-1, 1] - cell)])
    axes.autoscale_view()


def _quiver(axes: Any, xy: np.ndarray, arrows: np.ndarray, colour: Any, cell: float) -> Any:
    return axes.quiver(
        *xy.T,
        *arrows.T,
        color=colour,
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
