"""Shear strain in the frames in which the band reaches its four states, on a scale that shows where it counts."""

from typing import Any

import numpy as np

from colluvium.figures import domain, moments, style
from colluvium.results import band_states
from colluvium.results.run import Run
from colluvium.results.window_fields import bins, shear_strain

DECADE = 10.0  # on either side of the strain at which a state counts


def missing(run: Run) -> str:
    """Text of the missing data: a band and a window under overload. "" if there are both."""
    return moments.lacking(run) or ("" if moments.of_band(run) else "no frame with both sides")


@style.styled
def draw(run: Run) -> Any:
    """Draws one axes for each moment, strains logarithmic; zones move with their gridpoints, bins keep their positions."""
    import matplotlib.pyplot as plt
    from matplotlib.colors import LogNorm

    shown = moments.of_band(run)
    columns = min(len(shown), 2)
    rows = -(-len(shown) // columns)
    size = (style.PAGE, 0.4 + 2.7 * rows)
    figure, axes = plt.subplots(rows, columns, figsize=size, sharex=True, sharey=True, squeeze=False, layout="compressed")
    colours = {"norm": LogNorm(band_states.COUNTED / DECADE, band_states.COUNTED * DECADE), "cmap": style.colour_map("strain")}
    for place, moment in zip(axes.flat, shown, strict=False):
        frame = moment.frame
        zones, xy = run.zones(frame), domain.gridpoints_now(run, frame)
        drawn = domain.fill_polygons(place, xy[zones.corners], np.maximum(zones.shear_strain, 1e-9), **colours)
        for rank in run.windows:
            grid = bins(run, frame, rank)
            inside = shear_strain(run, frame, grid, rank)
            known = np.isfinite(inside)
            domain.fill_polygons(place, grid.rectangles[known], np.maximum(inside[known], 1e-9), **colours)
        domain.outline(place, xy, zones.corners)
        domain.finish(place, moments.title(run, moment))
    for place in list(axes.flat)[len(shown) :]:
        place.remove()
    domain.colour_bar(figure, drawn, list(axes.flat[: len(shown)]), f"shear strain [{run.units('shear_strain')}]", extend="both")
    return figure
