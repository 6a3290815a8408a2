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
    """Draws the last frame: the whole slope and, beside it, each window; in a row above, the last frame before a run-out."""
    import matplotlib.pyplot as plt

    shown = sorted({frames.before_run_out(run)[-1], frames.last(run)})
    columns = 1 + max(len(_windows(run, frame)) for frame in shown)
    figure, rows = plt.subplots(
        len(shown),
        columns,
        figsize=(style.PAGE * (1 + columns) / 3.0 if columns > 1 else 5.5, 3.3 * len(shown)),
        squeeze=False,
        width_ratios=(2.0, *[1.0] * (columns - 1)),
        layout="compressed",
    )
    for axes, frame in zip(rows, shown, strict=True):
        _draw_row(run, frame, figure, axes)
    return figure


def _windows(run: Run, frame: int) -> list[int]:
    """Ranks of the windows of a frame that has zones beside them; else none."""
    return [rank for rank in run.windows if run.has(frame, rank)] if run.has(frame, 0) else []


def _draw_row(run: Run, frame: int, figure: Any, axes: Any) -> None:
    """Draws a frame with its own colour scale, which its bar shows."""
    sizes = [np.linalg.norm(body.displacement, axis=1) for body in run.bodies(frame)]
    factor, unit = style.readable("m", *sizes)
    low, high = style.limits(*(factor * size for size in sizes))
    windows = _windows(run, frame)
    for place in axes:
        drawn = _draw_bodies(run, frame, place, factor)
        for artist in drawn:
            artist.set_clim(low, high)
        domain.finish(place, f"displacement: {style.moment(run.frames[frame])}{frames.note(run, frame)}")
    for place in axes[1 + len(windows) :]:
        place.set_axis_off()
    for place, rank in zip(axes[1:], windows, strict=False):
        _close_up(place, outline_of(run, frame, rank))
        place.set_title("the window and its rim" if len(run.windows) == 1 else f"window {run.name_of(rank)!r} and its rim")
        place.tick_params(labelleft=True)
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
