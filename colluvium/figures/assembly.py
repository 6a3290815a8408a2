"""Parts of a window: discs in their ring, the mesostructure, and the discs of each stone."""

from typing import Any

import numpy as np

from colluvium.figures import domain, mesostructure, style
from colluvium.figures.mesh import DISC, RING
from colluvium.results.run import Run
from colluvium.results.window_fields import outline_of, starting_places

BODIES = ("#b9a98f", "#8f7a5b", "#d3b98a", "#a0826a", "#c6a78c", "#7d6f5e")  # stones side by side, to tell them apart


def missing(run: Run, rank: int | None = None) -> str:
    """Text of the missing data: discs. "" if there are any."""
    return "" if run.windows else "no frame of discs"


@style.styled
def draw(run: Run, rank: int | None = None) -> Any:
    """Draws a window at the start: packing; with stones also mesostructure and both.

    rank None: the first window with stones, or the first one.
    """
    import matplotlib.pyplot as plt

    if rank is None:
        rank = next((rank for rank in run.windows if run.stones(rank)), run.windows[0])
    frame = next(i for i in range(len(run.frames)) if run.has(i, rank))
    discs, placed = run.discs(frame, rank), run.stones(rank)
    columns = 3 if placed else 1
    size = (0.8 + 3.0 * columns, 7.0)
    figure, axes = plt.subplots(1, columns, figsize=size, sharex=True, sharey=True, squeeze=False, layout="compressed")
    xy = starting_places(discs)
    control = discs.control == 1 if "control" in discs else np.zeros(len(xy), dtype=bool)
    colours = np.full(len(xy), DISC, dtype=object)
    colours[control] = RING
    _fill(axes[0, 0], xy, discs.radius, colours)
    walls = domain.draw_walls(axes[0, 0], run, frame)
    domain.finish(axes[0, 0], f"{(~control).sum():,} discs\n{_held_by(int(control.sum()), walls)}")
    if placed:
        mesostructure.panel(axes[0, 1], outline_of(run, frame, rank), placed)
        stone = discs.stone
        own = stone >= 0
        colours[own] = np.array(BODIES, dtype=object)[stone[own] % len(BODIES)]
        _fill(axes[0, 2], xy, discs.radius, colours)
        domain.stone_outlines(axes[0, 2], placed)
        domain.finish(axes[0, 2], f"{own.sum():,} of the discs\nmake up {len(np.unique(stone[own])):,} stones")
    return figure


def _held_by(control: int, walls: int) -> str:
    """Text of what holds the discs."""
    if control:
        return f"in a ring of {control:,} control discs"
    return f"between {walls} walls" if walls > 1 else "on a wall" if walls else "without walls"


def _fill(axes: Any, xy: np.ndarray, radius: np.ndarray, colours: np.ndarray) -> None:
    filled = domain.fill_discs(axes, xy, radius, DISC)
    filled.set_color(list(colours))
