"""Zones, discs, bins and outlines as matplotlib artists, in one axes with equal scales."""

from typing import Any

import numpy as np

from colluvium.figures.style import INK, PALE
from colluvium.results.run import Run


def gridpoints_now(run: Run, frame: int) -> np.ndarray:
    """(N, 2) where the gridpoints are in a frame [m]."""
    gridpoints = run.gridpoints(frame)
    return gridpoints.xy + gridpoints.displacement


def fill_polygons(axes: Any, corners: np.ndarray, values: np.ndarray | str, **colours: Any) -> Any:
    """Polygons (n, 4, 2) filled by values (n,) or with one colour, without visible seams."""
    from matplotlib.collections import PolyCollection

    filled = PolyCollection(list(corners), linewidths=0.2, **colours)
    _set_colour(filled, values)
    axes.add_collection(filled)
    return filled


def fill_discs(axes: Any, xy: np.ndarray, radius: np.ndarray, values: np.ndarray | str, **colours: Any) -> Any:
    """Discs in their true size, filled by values (n,) or with one colour."""
    from matplotlib.collections import EllipseCollection

    size = 2.0 * radius
    filled = EllipseCollection(
        size, size, np.zeros_like(size), units="xy", offsets=xy, offset_transform=axes.transData, **colours
    )
    filled.set_linewidth(0.1)
    _set_colour(filled, values)
    axes.add_collection(filled)
    if len(xy):
        axes.update_datalim(np.concatenate((xy - radius[:, None], xy + radius[:, None])))
    return filled


def outline(axes: Any, xy: np.ndarray, zones: np.ndarray, colour: str = INK, width: float = 0.8) -> None:
    """The edges that belong to one zone only: the border of the mesh and of its holes."""
    from matplotlib.collections import LineCollection

    edges = np.sort(np.stack((zones, np.roll(zones, -1, axis=1)), axis=2).reshape(-1, 2), axis=1)
    edges, count = np.unique(edges[edges[:, 0] != edges[:, 1]], axis=0, return_counts=True)
    axes.add_collection(LineCollection(xy[edges[count == 1]], colors=colour, linewidths=width, capstyle="round"))


def stone_outlines(axes: Any, polygons: list[np.ndarray]) -> None:
    """Outlines of stones, thin, on top of what is there."""
    from matplotlib.collections import PolyCollection

    axes.add_collection(PolyCollection(polygons, facecolors="none", edgecolors=INK, linewidths=0.4))


def finish(axes: Any, title: str) -> None:
    """Equal scales, the whole drawing in view, title and axis labels."""
    axes.set_aspect("equal")
    axes.margins(0.02)
    axes.autoscale_view()
    axes.set_title(title)
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.label_outer()
    axes.grid(color=PALE, linewidth=0.3)


def colour_bar(figure: Any, artist: Any, axes: Any, label: str, **options: Any) -> Any:
    """A colour bar with "quantity [unit]" beside the axes it belongs to."""
    return figure.colorbar(artist, ax=axes, label=label, shrink=0.85, aspect=30, **options)


def _set_colour(collection: Any, values: np.ndarray | str) -> None:
    if isinstance(values, str):
        collection.set_color(values)
    else:
        collection.set_array(values)
        collection.set_edgecolor("face")
