"""Displacement across the interface: zones and discs at their present positions, in one colour scale."""

from typing import Any

import numpy as np

from colluvium.figures import domain, frames, style
from colluvium.results import stones
from colluvium.results.run import Run
from colluvium.results.window_fields import outline_of


def missing(run: Run) -> str:
    """Text of the missing data: any frame. "" if there is one."""
    return "" if run.frames else "no frame was recorded"


@style.styled
def draw(run: Run) -> Any:
    """Draws the whole slope and, beside it, the first window, in the last frame before a run-out."""
    import matplotlib.pyplot as plt

    frame = frames.before_run_out(run)[-1]
    sizes = [np.linalg.norm(body.displacement, axis=1) for body in run.bodies(frame)]
    factor, unit = style.readable("m", *sizes)
    low, high = style.limits(*(factor * size for size in sizes))
    windows = [rank for rank in run.windows if run.has(frame, rank)]
    columns = 2 if windows and run.has(frame, 0) else 1
    figure, axes = plt.subplots(
        1,
        columns,
        figsize=(5.5 + 5.5 * (columns - 1), 4.8),
        squeeze=False,
        width_ratios=(2.0, 1.0)[:columns],
        layout="compressed",
    )
    for place in axes[0]:
        drawn = _draw_bodies(run, frame, place, factor)
        for artist in drawn:
            artist.set_clim(low, high)
        domain.finish(place, f"displacement: {style.moment(run.frames[frame])}")
    if columns == 2:
        _close_up(axes[0, 1], outline_of(run, frame, windows[0]))
        axes[0, 1].set_title("the window and its rim")
        axes[0, 1].tick_params(labelleft=True)
    domain.colour_bar(figure, drawn[0], axes, f"displacement [{unit}]", extend="max")
    return figure


def _draw_bodies(run: Run, frame: int, axes: Any, factor: float) -> list[Any]:
    drawn = []
    colours = {"cmap": style.colour_map("displacement")}
    if run.has(frame, 0):
        corners, xy = run.zones(frame).corners, domain.gridpoints_now(run, frame)
        size = factor * np.linalg.norm(run.gridpoints(frame).displacement, axis=1)
        triangles = np.concatenate((corners[:, [0, 1, 2]], corners[corners[:, 3] != corners[:, 2]][:, [0, 2, 3]]))
        drawn.append(axes.tripcolor(*xy.T, triangles, size, shading="gouraud", rasterized=True, **colours))
        domain.outline(axes, xy, corners)
    for rank in run.windows:
        if run.has(frame, rank):
            discs = run.discs(frame, rank)
            size = factor * np.linalg.norm(discs.displacement, axis=1)
            drawn.append(domain.fill_discs(axes, discs.xy, discs.radius, size, **colours))
            domain.stone_outlines(axes, stones.outlines(run, frame, rank))
    return drawn


def _close_up(axes: Any, window: np.ndarray) -> None:
    """Sets the view to a window with a margin of a quarter of its larger side."""
    low, high = window.min(axis=0), window.max(axis=0)
    margin = 0.25 * float((high - low).max())
    axes.set_xlim(low[0] - margin, high[0] + margin)
    axes.set_ylim(low[1] - margin, high[1] + margin)
