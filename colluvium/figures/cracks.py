"""Cracks of a window: a map, coloured by time, with marks by mode, and their number over time.

A crack in tension is a line of the size of the smaller disc, normal to the line between both discs; a crack in shear is a cross.
Places are those at the time of the break. Discs are drawn in the last frame.
"""

from typing import Any

import numpy as np

from colluvium.figures import domain, frames, histories, style
from colluvium.results import clock
from colluvium.results.cracks import Cracks
from colluvium.results.run import Run

TENSION, SHEAR = "#d0472f", "#123a5e"  # of the curves
CROSS = 9.0  # [pt2] area of the mark of a crack in shear


def missing(run: Run) -> str:
    """Text of the missing data: a bond that broke. "" if there is one."""
    if not run.windows:
        return "no frame of discs"
    return "" if len(run.cracks(run.windows[0]).step) else "no bond broke"


@style.styled
def draw(run: Run) -> Any:
    """Draws the first window: map of all cracks on the left, cumulative curves on the right."""
    import matplotlib.pyplot as plt

    rank = run.windows[0]
    found = run.cracks(rank)
    figure, (left, right) = plt.subplots(1, 2, figsize=(style.PAGE, 0.55 * style.PAGE), layout="constrained")
    last = frames.last(run, rank)
    domain.fill_discs(left, domain.discs_now(run, last, rank), run.discs(last, rank).radius, "#e9e6e1")
    domain.stone_outlines(left, domain.stones_now(run, last, rank))
    domain.draw_walls(left, run, last)
    shown = _draw_map(left, found)
    domain.finish(left, f"{len(found.step):,} breaks of bonds: lines in tension, crosses in shear")
    domain.colour_bar(figure, shown, left, "step [-]", location="bottom")
    _draw_curves(right, run, found)
    return figure


def _draw_map(axes: Any, found: Cracks) -> Any:
    """Draws all cracks, coloured by step; returns the artist of the colours."""
    from matplotlib.collections import LineCollection
    from matplotlib.colors import Normalize

    colours = {"cmap": style.colour_map("displacement"), "norm": Normalize(found.step.min(), max(found.step.max(), 1))}
    tension, shear = found.where(found.in_tension), found.where(~found.in_tension)
    lines = LineCollection(list(tension.segments), array=tension.step.astype(float), linewidths=1.0, zorder=3, **colours)
    axes.add_collection(lines)
    axes.scatter(*shear.place.T, c=shear.step.astype(float), s=CROSS, marker="x", linewidths=0.7, zorder=3, **colours)
    return lines


def _draw_curves(axes: Any, run: Run, found: Cracks) -> None:
    """Draws the number of breaks in tension and in shear over the steps of the run."""
    end = run.frames[-1].step
    for words, own, colour in (("tension", found.in_tension, TENSION), ("shear", ~found.in_tension, SHEAR)):
        steps = found.step[own]
        at = np.concatenate(([0], steps, [end]))
        number = np.concatenate(([0], np.arange(1, len(steps) + 1), [len(steps)]))
        axes.step(at, number, where="post", color=colour, label=f"{words}: {len(steps):,}", linewidth=1.0)
    starts = [start for part in clock.parts(run) for start in part.starts]
    histories.name_stages(run, clock.Part(False, 0, end, tuple(starts)), axes)
    for step, _ in starts:
        axes.axvline(step, color=style.PALE, linewidth=0.8, zorder=0)
    axes.set_xlabel("step [-]")
    axes.set_ylabel("breaks since the start [-]")
    axes.grid(color=style.PALE, linewidth=0.3)
    axes.legend(loc="upper left")
