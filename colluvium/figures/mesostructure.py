"""The stones of a window, and their sizes and azimuths compared with their distributions."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.stats import kstest, norm

from colluvium.figures import domain, style
from colluvium.results.run import Run
from colluvium.results.window_fields import outline_of
from coupler_protocol.geometry import moments, polygon_area

STONE, EDGE, SOIL = "#b9a98f", "#5b4a33", "#f4f0e8"
DRAWN, FOUND = "#d0472f", "#123a5e"


def missing(run: Run, rank: int | None = None) -> str:
    """Text of the missing data: stones of a window (none: of any). "" if there are any."""
    return "" if any(run.stones(one) for one in (run.windows if rank is None else [rank])) else "no stones"


@style.styled
def draw(run: Run, rank: int | None = None) -> Any:
    """Draws a window (none: the first with stones): positions, sizes and azimuths."""
    import matplotlib.pyplot as plt

    if rank is None:
        rank = next(rank for rank in run.windows if run.stones(rank))
    frame = next(i for i in range(len(run.frames)) if run.has(i, rank))
    placed, window = run.stones(rank), outline_of(run, frame, rank)
    figure = plt.figure(figsize=(8.5, 6.5), layout="constrained")
    grid = figure.add_gridspec(2, 2, width_ratios=(1.0, 1.3))
    panel(figure.add_subplot(grid[:, 0]), window, placed)
    table = run.stones_table(rank)
    sizes(figure.add_subplot(grid[0, 1]), placed, table.get("size"))
    azimuths(figure.add_subplot(grid[1, 1]), placed, table)
    return figure


@style.styled
def draw_side_by_side(window: np.ndarray, structures: Sequence[Sequence[np.ndarray]]) -> Any:
    """Draws several mesostructures of one window (P, 2), each a list of polygons, as in the paper's Figure 7."""
    import matplotlib.pyplot as plt

    size = len(structures)
    figure, axes = plt.subplots(1, size, figsize=(0.8 + 2.4 * size, 6.4), sharey=True, squeeze=False, layout="constrained")
    for place, placed, letter in zip(axes[0], structures, "abcdefgh", strict=False):
        panel(place, window, placed, f"({letter}) ")
    return figure


def panel(axes: Any, window: np.ndarray, placed: Sequence[np.ndarray], before: str = "") -> None:
    """Draws stones in their window; the title gives their number and content."""
    from matplotlib.collections import PolyCollection

    axes.add_collection(PolyCollection([window], facecolors=SOIL, edgecolors=style.INK, linewidths=1.0))
    axes.add_collection(PolyCollection(list(placed), facecolors=STONE, edgecolors=EDGE, linewidths=0.6))
    content = sum(map(polygon_area, placed)) / polygon_area(window)
    domain.finish(axes, f"{before}C = {100 * content:.2f} %, {len(placed)} stones")


def sizes(axes: Any, placed: Sequence[np.ndarray], size: dict[str, float] | None) -> None:
    """Draws the share of the stones smaller than a size, and the distribution of the scene if the stones are random."""
    found = np.sort([np.sqrt(4.0 * polygon_area(outline) / np.pi) for outline in placed])
    words, low, high = f"{len(found)} stones, mean {found.mean():.3f} m", found[0], found[-1]
    title = "sizes, as mapped"
    if size is not None:
        low, high = size["min"], size["max"]
        title = f"sizes: mean {size['mean']:g} m, sigma {size['sigma']:g}, {low:g} to {high:g} m"
        words += "\n" + _drawn_sizes(axes, found, size)
    axes.step([low, *found, high], np.append(np.arange(len(found) + 1) / len(found), 1.0), where="post", color=FOUND, label=words)
    axes.set_title(title)
    axes.set_xlabel("diameter of the circle of equal area [m]")
    axes.set_ylabel("share of stones that are smaller [-]")
    axes.legend(loc="lower right")


def _drawn_sizes(axes: Any, found: np.ndarray, size: dict[str, float]) -> str:
    """Draws the distribution of sizes of the scene; returns a text with its distance from the sizes `found`."""
    mu = np.log(size["mean"]) - 0.5 * size["sigma"] ** 2
    s = np.linspace(size["min"], size["max"], 300)
    whole = norm(mu, size["sigma"]).cdf
    low, high = whole(np.log([size["min"], size["max"]]))

    def smaller(s: np.ndarray) -> np.ndarray:
        return (whole(np.log(s)) - low) / (high - low)

    axes.plot(s, smaller(s), color=DRAWN, label="lognormal between its limits, drawn from")
    apart, expected = kstest(found, smaller).statistic, 1.358 / np.sqrt(len(found))  # Kolmogorov's 95 %
    return f"at most {apart:.3f} apart (95 % of samples: {expected:.3f})"


def azimuths(axes: Any, placed: Sequence[np.ndarray], stones: dict[str, Any]) -> None:
    """Draws directions of the long axes in six classes, and the distribution of the scene with its 95 % interval."""
    angle = np.degrees([moments(outline).azimuth for outline in placed]) % 180.0
    edges = np.arange(0.0, 181.0, 30.0)
    number, *_ = axes.hist(angle, edges, color=FOUND, rwidth=0.92, label="stones")
    top = number.max()
    if stones.get("file") is None:
        share = azimuth_shares(edges, stones.get("azimuth"))
        mean, spread = len(placed) * share, 1.96 * np.sqrt(len(placed) * share * (1.0 - share))
        top = max(top, (mean + spread).max())
        name = "uniform" if stones.get("azimuth") is None else "distribution"
        lines = ((mean, "-", f"{name}, drawn from"), (mean - spread, ":", None), (mean + spread, ":", "95 % of samples"))
        for values, linestyle, words in lines:
            axes.step(edges, np.append(values, values[-1]), linestyle, where="post", color=DRAWN, linewidth=1.0, label=words)
    axes.set_ylim(0.0, 1.3 * top)
    axes.set_title("azimuths")
    axes.set_xlabel("direction of the long axis [deg]")
    axes.set_ylabel("number of stones [-]")
    axes.set_xticks(edges)
    axes.legend(loc="upper center", ncols=3, columnspacing=1.0, handlelength=1.2)


def azimuth_shares(edges: np.ndarray, azimuth: dict[str, Any] | None) -> np.ndarray:
    """Shares of the classes between `edges` [deg], 0 to 180, by the scene's `stones.azimuth` table (None: uniform)."""
    turns = edges[:, None] + 180.0 * np.arange(-8, 9)  # the same axis, counted again
    if azimuth is None:
        return np.diff(edges) / 180.0
    if azimuth["range"] is not None:
        low, high = azimuth["range"]
        below = np.clip((turns - low) / (high - low), 0.0, 1.0) if high > low else 1.0 * (turns > low)
    else:
        scale = max(azimuth["spread"], 1e-9)
        below = norm(azimuth["mean"], scale).cdf(turns)
    return np.diff(below.sum(axis=1))
