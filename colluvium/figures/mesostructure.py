"""The stones of a window, and their sizes and azimuths against the distributions they were drawn from."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.stats import kstest, norm

from colluvium.figures import domain, style
from colluvium.results import Run
from colluvium.window_fields import outline_of
from coupler_protocol.interface import polygon_area
from dem_server.polygons import moments

STONE, EDGE, SOIL = "#b9a98f", "#5b4a33", "#f4f0e8"
DRAWN, FOUND = "#d0472f", "#123a5e"


def missing(run: Run) -> str:
    """A window with stones."""
    return "" if any(run.stones(rank) for rank in run.windows) else "no stones"


@style.styled
def draw(run: Run) -> Any:
    """The first window with stones: where they lie, their sizes, their azimuths."""
    import matplotlib.pyplot as plt

    rank = next(rank for rank in run.windows if run.stones(rank))
    frame = next(i for i in range(len(run.frames)) if run.has(i, rank))
    placed, window = run.stones(rank), outline_of(run, frame, rank)
    figure = plt.figure(figsize=(8.5, 6.5), layout="constrained")
    grid = figure.add_gridspec(2, 2, width_ratios=(1.0, 1.3))
    panel(figure.add_subplot(grid[:, 0]), window, placed)
    sizes(figure.add_subplot(grid[0, 1]), placed, run.scene["stones"]["size"])
    azimuths(figure.add_subplot(grid[1, 1]), placed)
    return figure


@style.styled
def draw_side_by_side(window: np.ndarray, structures: Sequence[Sequence[np.ndarray]]) -> Any:
    """Several mesostructures of one window (P, 2), each a list of polygons, as in the paper's Figure 7."""
    import matplotlib.pyplot as plt

    size = len(structures)
    figure, axes = plt.subplots(1, size, figsize=(0.8 + 2.4 * size, 6.4), sharey=True, squeeze=False, layout="constrained")
    for place, placed, letter in zip(axes[0], structures, "abcdefgh", strict=False):
        panel(place, window, placed, f"({letter}) ")
    return figure


def panel(axes: Any, window: np.ndarray, placed: Sequence[np.ndarray], before: str = "") -> None:
    """Stones in their window; the title says how many there are and which share of the area they cover."""
    from matplotlib.collections import PolyCollection

    axes.add_collection(PolyCollection([window], facecolors=SOIL, edgecolors=style.INK, linewidths=1.0))
    axes.add_collection(PolyCollection(list(placed), facecolors=STONE, edgecolors=EDGE, linewidths=0.6))
    content = sum(map(polygon_area, placed)) / polygon_area(window)
    domain.finish(axes, f"{before}C = {100 * content:.2f} %, {len(placed)} stones")


def sizes(axes: Any, placed: Sequence[np.ndarray], size: dict[str, float]) -> None:
    """Share of the stones smaller than a size: found, and drawn from."""
    found = np.sort([np.sqrt(4.0 * polygon_area(outline) / np.pi) for outline in placed])
    mu = np.log(size["mean"]) - 0.5 * size["sigma"] ** 2
    s = np.linspace(size["min"], size["max"], 300)
    whole = norm(mu, size["sigma"]).cdf
    low, high = whole(np.log([size["min"], size["max"]]))

    def smaller(s: np.ndarray) -> np.ndarray:
        return (whole(np.log(s)) - low) / (high - low)

    apart, expected = kstest(found, smaller).statistic, 1.358 / np.sqrt(len(found))  # Kolmogorov's 95 %
    words = f"{len(found)} stones, mean {found.mean():.3f} m\nat most {apart:.3f} apart (95 % of samples: {expected:.3f})"
    axes.plot(s, smaller(s), color=DRAWN, label="lognormal between its limits, drawn from")
    axes.step(
        [size["min"], *found, size["max"]],
        np.append(np.arange(len(found) + 1) / len(found), 1.0),
        where="post",
        color=FOUND,
        label=words,
    )
    axes.set_title(f"sizes: mean {size['mean']:g} m, sigma {size['sigma']:g}, {size['min']:g} to {size['max']:g} m")
    axes.set_xlabel("diameter of the circle of equal area [m]")
    axes.set_ylabel("share of stones that are smaller [-]")
    axes.legend(loc="lower right")


def azimuths(axes: Any, placed: Sequence[np.ndarray]) -> None:
    """Directions of the long axes in six classes, and the uniform distribution with its 95 % interval."""
    second = np.array([moments(outline).second for outline in placed])
    angle = np.degrees(0.5 * np.arctan2(2.0 * second[:, 0, 1], second[:, 0, 0] - second[:, 1, 1])) % 180.0
    edges = np.arange(0.0, 181.0, 30.0)
    count, share = len(placed), 1.0 / (len(edges) - 1)
    number, *_ = axes.hist(angle, edges, color=FOUND, rwidth=0.92, label="stones")
    spread = 1.96 * np.sqrt(count * share * (1.0 - share))
    axes.axhline(count * share, color=DRAWN, label="uniform, drawn from")
    for limit, words in ((count * share - spread, None), (count * share + spread, "95 % of samples")):
        axes.axhline(limit, color=DRAWN, linestyle=":", linewidth=1.0, label=words)
    axes.set_ylim(0.0, 1.3 * max(number.max(), count * share + spread))
    axes.set_title("azimuths")
    axes.set_xlabel("direction of the long axis [deg]")
    axes.set_ylabel("number of stones [-]")
    axes.set_xticks(edges)
    axes.legend(loc="upper center", ncols=3, columnspacing=1.0, handlelength=1.2)
