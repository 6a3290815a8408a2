"""Picture of the mechanism in the trial with the lowest factor that fails: grid, discs, and the force chains that carry it."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from colluvium.figures import chains, domain, style
from colluvium.results.run import Run, open_run
from fdm_server.fos.verdict import FAILS

ARROWS = 22  # number across the longer side
CHAIN = "#1f6fb5"


def write(out: Path, found: dict[str, Any]) -> Path | None:
    """Draws the mechanism of a search into its folder; found: `coupled` of fos.json. None: no trial has failed."""
    import matplotlib.pyplot as plt

    failed = [row for row in found["trials"] if row["verdict"] == FAILS]
    if not failed:
        return None
    first = min(failed, key=lambda row: row["factor"])
    with open_run(out / "trials" / first["folder"]) as run:
        figure = draw(run, f"factor of safety {found['value']:.3f}, at {first['factor']:.4g}")
    path = out / "coupled_mechanism.png"
    figure.savefig(path)
    plt.close(figure)
    return path


def moved(run: Run, rank: int | None = None) -> np.ndarray:
    """Displacements (n, 2) [m] since strength was reduced, of gridpoints, or of the discs of a window."""
    last = len(run.frames) - 1
    bodies = [run.gridpoints(f) if rank is None else run.discs(f, rank) for f in (0, last)]
    return bodies[1].displacement - bodies[0].displacement


def carried(run: Run, rank: int) -> tuple[Any, np.ndarray]:
    """Force chains of a window in the last frame, and the numbers of the stones in them."""
    last = len(run.frames) - 1
    found, discs = run.force_chains(last, rank), run.discs(last, rank)
    if "stone" not in discs:
        return found, np.zeros(0, dtype=np.int64)
    stones = np.unique(discs.stone[found.links.ravel()])
    return found, stones[stones >= 0]


@style.styled
def draw(run: Run, title: str) -> Any:
    """Draws the incremental displacement of the whole slope, and of each window with its chains, on one scale of colours."""
    import matplotlib.pyplot as plt

    last, ranks = len(run.frames) - 1, run.windows
    figure, axes = plt.subplots(1, 1 + len(ranks), figsize=(6.5 + 3.0 * len(ranks), 5.2), layout="constrained", squeeze=False)
    whole, grid = axes[0, 0], moved(run)
    drawn, most = draw_slope(whole, run, grid, last, ranks)
    domain.finish(whole, f"displacement since strength was reduced\n{title}")
    for rank, place in zip(ranks, axes[0, 1:], strict=True):
        _window(run, rank, place, most)
        found, stones = carried(run, rank)
        _chains(run, rank, place, found, stones)
        words = f"\n{len(stones)} stones in chains" if len(stones) else ""
        domain.finish(place, f"window {rank}: {chains.in_words(found)}{words}")
    domain.colour_bar(figure, drawn, whole, "displacement over the largest of a gridpoint [-]")
    return figure


def draw_slope(axes: Any, run: Run, grid: np.ndarray, frame: int, ranks: Sequence[int]) -> tuple[Any, float]:
    """Draws displacements `grid` (N, 2) [m] of gridpoints in a frame, and of the discs of `ranks` since the first frame.

    Returns the coloured zones and the largest displacement [m], to which colours and arrows belong.
    """
    points, zones, length = run.gridpoints(frame), run.zones(frame), np.hypot(*grid.T)
    most = max(float(length.max()), 1e-300)  # of a gridpoint: a disc without contacts can move farther
    drawn = domain.fill_polygons(axes, points.xy[zones.corners], length[zones.corners].mean(axis=1) / most, **_colours())
    for rank in ranks:
        _window(run, rank, axes, most)
    far = length > 0.02 * most
    chosen = np.flatnonzero(far)[:: max(1, int(far.sum()) // (ARROWS * ARROWS // 2))]
    axes.quiver(*points.xy[chosen].T, *(grid[chosen] / most).T, color=style.INK, width=0.0018, scale=ARROWS)
    domain.outline(axes, points.xy, zones.corners)
    return drawn, most


def _colours() -> dict[str, Any]:
    from matplotlib.colors import Normalize

    return {"norm": Normalize(0.0, 1.0), "cmap": style.colour_map("rate")}


def _window(run: Run, rank: int, axes: Any, most: float) -> None:
    """Discs by their displacement."""
    last = len(run.frames) - 1
    discs = run.discs(last, rank)
    domain.fill_discs(axes, domain.discs_now(run, last, rank), discs.radius, np.hypot(*moved(run, rank).T) / most, **_colours())


def _chains(run: Run, rank: int, axes: Any, found: Any, stones: np.ndarray) -> None:
    """Force chains, outlines of all stones, and the stones in chains filled."""
    from matplotlib.collections import LineCollection, PolyCollection

    last = len(run.frames) - 1
    xy, outlines = domain.discs_now(run, last, rank), domain.stones_now(run, last, rank)
    axes.add_collection(LineCollection(xy[found.links], linewidths=1.0, colors=CHAIN, capstyle="round", label="force chains"))
    domain.stone_outlines(axes, outlines)
    strong = [outlines[k] for k in stones if k < len(outlines)]
    axes.add_collection(PolyCollection(strong, facecolors=CHAIN, edgecolors=CHAIN, alpha=0.45, linewidths=0.6))
