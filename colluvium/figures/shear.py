"""Shear strain and its rate, which show the shear band; in windows the strain of discs in bins."""

from typing import Any

import numpy as np

from colluvium.figures import domain, frames, moments, style
from colluvium.results.run import Run
from colluvium.results.window_fields import bins, shear_strain

DECADES = 3.0


def missing(run: Run) -> str:
    """Text of the missing data: a continuum. "" if there is one."""
    return "" if run.recorded(0) else "no frame of the continuum"


@style.styled
def draw_rate(run: Run) -> Any:
    """Draws the shear strain rate, logarithmic over three decades below the largest, in each state of the band."""
    shown = moments.of_run(run, 0)
    return _panels(run, shown, "shear_strain_rate", "velocity", "shear strain rate", "rate")


@style.styled
def draw_strain(run: Run) -> Any:
    """Draws the shear strain, on a scale of the same kind, in even steps of the last stage and in the last frame."""
    shown = [moments.Moment("", frame) for frame in frames.of_last_stage(run, 0, moments.PANELS)]
    return _panels(run, shown, "shear_strain", "displacement", "shear strain", "strain")


def _panels(run: Run, shown: list[moments.Moment], field: str, motion: str, name: str, colours: str) -> Any:
    """Draws one axes for each moment, all in one colour scale: that of the moments before a run-out."""
    import matplotlib.pyplot as plt
    from matplotlib.colors import LogNorm

    columns = min(len(shown), 2)
    rows = -(-len(shown) // columns)
    figure, axes = plt.subplots(
        rows,
        columns,
        figsize=(style.PAGE * columns / 2, 2.8 * rows),
        sharex=True,
        sharey=True,
        squeeze=False,
        layout="compressed",
    )
    parts = [_fields(run, moment.frame, field, motion) for moment in shown]
    calm = frames.before_run_out(run)[-1]
    before = [part for moment, part in zip(shown, parts, strict=True) if moment.frame <= calm] or parts
    largest = style.limits(*(value for part in before for _, value in part))[1]
    lowest = (largest if largest > 0.0 else 1.0) * 10.0**-DECADES
    norm = LogNorm(lowest, largest if largest > 0.0 else 1.0)
    for place, moment, part in zip(axes.flat, shown, parts, strict=False):
        for corners, value in part:
            seen = np.maximum(value, lowest)
            drawn = domain.fill_polygons(place, corners, seen, norm=norm, cmap=style.colour_map(colours))
        domain.outline(place, run.gridpoints(moment.frame).xy, run.zones(moment.frame).corners)
        domain.finish(place, f"{name}: {moments.title(run, moment)}")
    for place in list(axes.flat)[len(shown) :]:
        place.set_axis_off()
    domain.colour_bar(figure, drawn, axes, f"{name} [{_unit(run, field, shown)}]", extend="both")
    return figure


def _unit(run: Run, field: str, shown: list[moments.Moment]) -> str:
    """Unit of a field in all moments: rates are per step in static stages."""
    return " or ".join(dict.fromkeys(run.units(field, moment.frame) for moment in shown))


def _fields(run: Run, frame: int, field: str, motion: str) -> list[tuple[np.ndarray, np.ndarray]]:
    """Polygons and values at a frame: bins of windows, and over them zones, because bins may reach beyond an oblique rim."""
    zones, parts = run.zones(frame), []
    for rank in run.windows:
        if run.has(frame, rank):
            grid = bins(run, frame, rank)
            inside = shear_strain(run, frame, grid, rank, motion)
            known = np.isfinite(inside)
            parts.append((grid.rectangles[known], inside[known]))
    return [*parts, (run.gridpoints(frame).xy[zones.corners], zones[field])]
