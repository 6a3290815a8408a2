"""Shear strain and its rate: where the shear band is. In the window from the discs, bin by bin."""

from collections.abc import Callable
from typing import Any

import numpy as np

from colluvium.figures import domain, style
from colluvium.results import Run
from colluvium.window_fields import bins, shear_strain

PANELS = 4
DECADES = 4.0


def applies(run: Run) -> bool:
    """A continuum was recorded."""
    return 0 in run.files


def moments(run: Run) -> list[int]:
    """Up to four frames from the last stage, evenly spread, its last frame among them."""
    stage = [i for i, info in enumerate(run.frames) if info.stage == run.frames[-1].stage and run.has(i, 0)]
    return sorted({stage[round(part)] for part in np.linspace(len(stage) - 1, 0, PANELS + 1)[:-1]})


@style.styled
def draw_rate(run: Run) -> Any:
    """Shear strain rate, logarithmic over four decades below the largest."""
    from matplotlib.colors import LogNorm

    def scale(largest: float) -> LogNorm:
        top = largest if largest > 0.0 else 1.0
        return LogNorm(top * 10.0**-DECADES, top)

    return _panels(run, "shear_strain_rate", "velocity", "shear strain rate", "rate", scale)


@style.styled
def draw_strain(run: Run) -> Any:
    """Shear strain, from zero to nearly the largest."""
    from matplotlib.colors import Normalize

    return _panels(
        run, "shear_strain", "displacement", "shear strain", "strain", lambda largest: Normalize(0.0, largest)
    )


def _panels(run: Run, field: str, motion: str, name: str, colours: str, scale: Callable[[float], Any]) -> Any:
    """One axes a moment, all in one colour scale."""
    import matplotlib.pyplot as plt

    frames = moments(run)
    columns = min(len(frames), 2)
    rows = -(-len(frames) // columns)
    figure, axes = plt.subplots(
        rows,
        columns,
        figsize=(5.5 * columns, 3.6 * rows),
        sharex=True,
        sharey=True,
        squeeze=False,
        layout="compressed",
    )
    parts = {frame: _fields(run, frame, field, motion) for frame in frames}
    norm = scale(style.limits(*(value for part in parts.values() for _, value in part))[1])
    for place, frame in zip(axes.flat, frames, strict=False):
        for corners, value in parts[frame]:
            shown = np.maximum(value, norm.vmin)
            drawn = domain.fill_polygons(place, corners, shown, norm=norm, cmap=style.colour_map(colours))
        domain.outline(place, run.gridpoints(frame).xy, run.zones(frame).corners)
        domain.finish(place, f"{name}: {style.moment(run.frames[frame])}")
    for place in list(axes.flat)[len(frames) :]:
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
