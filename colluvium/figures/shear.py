"""Shear strain and its rate: where the shear band is. In the window from the discs, bin by bin."""

from collections.abc import Callable
from typing import Any

import numpy as np

from colluvium.figures import domain, frames, style
from colluvium.results import Run
from colluvium.window_fields import bins, shear_strain

PANELS = 4
DECADES = 3.0


def applies(run: Run) -> bool:
    """A continuum was recorded."""
    return run.recorded(0)


@style.styled
def draw_rate(run: Run) -> Any:
    """Shear strain rate, logarithmic over three decades below the largest."""
    from matplotlib.colors import LogNorm

    def scale(largest: float) -> LogNorm:
        top = largest if largest > 0.0 else 1.0
        return LogNorm(top * 10.0**-DECADES, top)

    return _panels(run, "shear_strain_rate", "velocity", "shear strain rate", "rate", scale)


@style.styled
def draw_strain(run: Run) -> Any:
    """Shear strain, from zero to nearly the largest."""
    from matplotlib.colors import Normalize

    return _panels(run, "shear_strain", "displacement", "shear strain", "strain", lambda largest: Normalize(0.0, largest))


def _panels(run: Run, field: str, motion: str, name: str, colours: str, scale: Callable[[float], Any]) -> Any:
    """One axes a moment, all in one colour scale."""
    import matplotlib.pyplot as plt

    moments = frames.of_last_stage(run, 0, PANELS)
    columns = min(len(moments), 2)
    rows = -(-len(moments) // columns)
    figure, axes = plt.subplots(
        rows,
        columns,
        figsize=(5.5 * columns, 3.6 * rows),
        sharex=True,
        sharey=True,
        squeeze=False,
        layout="compressed",
    )
    parts = {frame: _fields(run, frame, field, motion) for frame in moments}
    norm = scale(style.limits(*(value for part in parts.values() for _, value in part))[1])
    for place, frame in zip(axes.flat, moments, strict=False):
        for corners, value in parts[frame]:
            shown = np.maximum(value, norm.vmin)
            drawn = domain.fill_polygons(place, corners, shown, norm=norm, cmap=style.colour_map(colours))
        domain.outline(place, run.gridpoints(frame).xy, run.zones(frame).corners)
        domain.finish(place, f"{name}: {style.moment(run.frames[frame])}")
    for place in list(axes.flat)[len(moments) :]:
        place.set_axis_off()
    domain.colour_bar(figure, drawn, axes, f"{name} [{run.units(field)}]", extend="max")
    return figure


def _fields(run: Run, frame: int, field: str, motion: str) -> list[tuple[np.ndarray, np.ndarray]]:
    """Polygons and values of the zones and of the windows' bins at a frame."""
    zones = run.zones(frame)
    parts = [(run.gridpoints(frame).xy[zones.corners], zones[field])]
    for rank in run.windows:
        if run.has(frame, rank):
            grid = bins(run, frame, rank)
            inside = shear_strain(run, frame, grid, rank, motion)
            known = np.isfinite(inside)
            parts.append((grid.rectangles[known], inside[known]))
    return parts
