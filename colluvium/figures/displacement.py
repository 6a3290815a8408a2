"""Displacement across the interface: zones and discs at their present positions, in one colour scale."""

from typing import Any

import numpy as np

from colluvium.figures import domain, frames, style
from colluvium.results.run import Run
from colluvium.results.window_fields import outline_of


def missing(run: Run) -> str:
    """Text of the missing data: any frame. "" if there is one."""
    return "" if run.frames else "no frame was recorded"


@style.styled
def draw(run: Run) -> Any:
    """Draws the last frame: the whole slope and, beside it, the first window; in a row above, the last frame before a run-out."""
    import matplotlib.pyplot as plt

    shown = sorted({frames.before_run_out(run)[-1], frames.last(run)})
    columns = max(1 + _has_window(run, frame) for frame in shown)
    figure, rows = plt.subplots(
        len(shown),
        columns,
        figsize=(style.PAGE if columns > 1 else 5.5, 3.3 * len(shown)),
        squeeze=False,
        width_ratios=(2.0, 1.0)[:columns],
        layout="compressed",
    )
    for axes, frame in zip(rows, shown, strict=True):
        _draw_row(run, frame, figure, axes)
    return figure


def _has_window(run: Run, frame: int) -> bool:
    """Whether a frame has zones and a window beside them."""
    return run.has(frame, 0) and any(run.has(frame, rank) for rank in run.windows)


def _draw_row(run: Run, frame: int, figure: Any, axes: Any) -> None:
    """Draws a frame with its own colour scale, which its bar shows."""
    sizes = [np.linalg.norm(body.displacement, axis=1) for body in run.bodies(frame)]
    factor, unit = style.readable("m", *sizes)
    low, high = style.limits(*(factor * size for size in sizes))
    windows = [rank for rank in run.windows if run.has(frame, rank)]
    for place in axes:
        drawn = _draw_bodies(run, frame, place, factor)
        for artist in drawn:
            artist.set_clim(low, high)
        domain.finish(place, f"displacement: {style.moment(run.frames[frame])}{frames.note(run, frame)}")
    if len(axes) == 2 and not _has_window(run, frame):
        axes[1].set_axis_off()
    elif len(axes) == 2:
        _close_up(axes[1], outline_of(run, frame, windows[0]))
        axes[1].set_title("the window and its rim")
        axes[1].tick_params(labelleft=True)
    domain.colour_bar(figure, drawn[0], list(axes), f"displacement [{unit}]", extend="max")


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
            drawn.append(domain.fill_discs(axes, domain.discs_now(run, frame, rank), discs.radius, size, **colours))
            domain.stone_outlines(axes, domain.stones_now(run, frame, rank))
    domain.draw_walls(axes, run, frame)
    return drawn


def _close_up(axes: Any, window: np.ndarray) -> None:
    """Sets the view to a window with a margin of a quarter of its larger side."""
    low, high = window.min(axis=0), window.max(axis=0)
    margin = 0.25 * float((high - low).max())
    axes.set_xlim(low[0] - margin, high[0] + margin)
    axes.set_ylim(low[1] - margin, high[1] + margin)
