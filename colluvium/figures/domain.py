"""Zones, discs, bins and outlines as matplotlib artists, in axes with equal scales."""

from typing import Any

import numpy as np

from colluvium.figures import frames
from colluvium.figures.style import INK, PAGE, PALE
from colluvium.results import stones, walls
from colluvium.results.run import Run

WALL = "#6b4a2b"
COLUMNS = 3  # panels in a row
EDGE = 0.03  # of the larger side of a view: room for walls beside it
TALLEST, TITLE_ROOM = 4.2, 0.7  # [in] of a panel


def gridpoints_now(run: Run, frame: int) -> np.ndarray:
    """(N, 2) positions of the gridpoints in a frame [m]; in a run-out with a part of their displacements."""
    gridpoints = run.gridpoints(frame)
    return gridpoints.xy + frames.drawn_part(run, frame) * gridpoints.displacement


def discs_now(run: Run, frame: int, rank: int) -> np.ndarray:
    """(n, 2) positions of the discs in a frame [m]; in a run-out with a part of their displacements."""
    discs = run.discs(frame, rank)
    return discs.xy - (1.0 - frames.drawn_part(run, frame)) * discs.displacement


def stones_now(run: Run, frame: int, rank: int) -> list[np.ndarray]:
    """Polygons (V, 2) of the stones in a frame [m]; in a run-out with a part of their displacements."""
    part = frames.drawn_part(run, frame)
    moved = stones.outlines(run, frame, rank)
    return [start + part * (now - start) for start, now in zip(run.stones(rank), moved, strict=False)]


def fill_polygons(axes: Any, corners: np.ndarray, values: np.ndarray | str, **colours: Any) -> Any:
    """Draws polygons (n, 4, 2) filled by values (n,) or with one colour, without visible seams; returns the artist."""
    from matplotlib.collections import PolyCollection

    filled = PolyCollection(list(corners), linewidths=0.2, **colours)
    _set_colour(filled, values)
    axes.add_collection(filled)
    return filled


def fill_discs(axes: Any, xy: np.ndarray, radius: np.ndarray, values: np.ndarray | str, **colours: Any) -> Any:
    """Draws discs in their true size, filled by values (n,) or with one colour; returns the artist."""
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
    """Draws the edges that belong to one zone only: the border of the mesh and of its holes."""
    from matplotlib.collections import LineCollection

    edges = np.sort(np.stack((zones, np.roll(zones, -1, axis=1)), axis=2).reshape(-1, 2), axis=1)
    edges, count = np.unique(edges[edges[:, 0] != edges[:, 1]], axis=0, return_counts=True)
    axes.add_collection(LineCollection(xy[edges[count == 1]], colors=colour, linewidths=width, capstyle="round"))


def stone_outlines(axes: Any, polygons: list[np.ndarray]) -> None:
    """Draws thin outlines of stones over all other artists."""
    from matplotlib.collections import PolyCollection

    axes.add_collection(PolyCollection(polygons, facecolors="none", edgecolors=INK, linewidths=0.4))


def panels(count: int, seen: np.ndarray) -> tuple[Any, list[Any]]:
    """A figure with `count` equal axes for drawings around `seen` (n, 2) [m], at most COLUMNS in a row, and its axes."""
    import matplotlib.pyplot as plt

    width, height = np.ptp(seen, axis=0)
    columns = min(count, COLUMNS)
    rows = -(-count // columns)
    tall = min(TALLEST, 0.9 * PAGE / columns * height / width) + TITLE_ROOM
    figure, axes = plt.subplots(
        rows, columns, figsize=(PAGE, rows * tall + 0.6), sharex=True, sharey=True, squeeze=False, layout="compressed"
    )
    for place in axes.flat[count:]:
        place.set_axis_off()
    return figure, list(axes.flat[:count])


def draw_walls(axes: Any, run: Run, frame: int) -> int:
    """Draws the walls of discs alone in a frame over other artists, which they widen by EDGE at most. Returns their number."""
    from matplotlib.collections import LineCollection

    found = list(walls.ends(run, frame).values())
    axes.add_collection(
        LineCollection(found, colors=WALL, linewidths=1.6, capstyle="butt", zorder=2.5, label="walls"), autolim=False
    )
    if found:
        low, high = axes.dataLim.get_points()
        room = EDGE * np.max(high - low)
        axes.update_datalim(np.clip(np.concatenate(found), low - room, high + room))
    return len(found)


def finish(axes: Any, title: str) -> None:
    """Sets equal scales, the view of the whole drawing, title and axis labels."""
    axes.set_aspect("equal")
    axes.margins(0.02)
    axes.autoscale_view()
    axes.set_title(title)
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.label_outer()
    axes.grid(color=PALE, linewidth=0.3)


def colour_bar(figure: Any, artist: Any, axes: Any, label: str, **options: Any) -> Any:
    """Draws a colour bar with the label "quantity [unit]" beside its axes; returns it."""
    return figure.colorbar(artist, ax=axes, label=label, shrink=0.85, aspect=30, **options)


def _set_colour(collection: Any, values: np.ndarray | str) -> None:
    if isinstance(values, str):
        collection.set_color(values)
    else:
        collection.set_array(values)
        collection.set_edgecolor("face")
