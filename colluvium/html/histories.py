"""Histories as small SVG plots, each with a marker that the page moves to the displayed step, and the values of their points.

Point k of a line of a plot is entry k of its two arrays in the page: step or horizontal value, and value.
"""

from collections.abc import Callable, Iterator
from html import escape
from math import ceil, floor, log10
from typing import Any, NamedTuple

import numpy as np

from colluvium.figures import style
from colluvium.figures.histories import COLOURS, NARROWEST, Row, recorded_rows
from colluvium.html.packing import Packing
from colluvium.results import clock, load_curves
from colluvium.results.run import Run

WIDTH, HEIGHT = 460, 170
LEFT, RIGHT, TOP, BOTTOM = 58, 8, 26, 22  # room around the axes
COLUMNS = 400  # parts of a longer history, of which the smallest and the largest value are kept


class Axis:
    """Horizontal axis of all plots: parts of the run beside each other, in real time over seconds, in static mode over steps."""

    def __init__(self, run: Run) -> None:
        self.run, self.parts = run, clock.parts(run)
        length = np.array([part.last - part.first for part in self.parts], dtype=float)
        share = np.maximum(length / length.max(), NARROWEST)
        self._ends = np.append(0.0, np.cumsum(share / share.sum()))
        self._span = [clock.places(run, part, np.array([part.first, part.last])) for part in self.parts]

    def across(self, step: float) -> float:
        """Place of a step, from 0 to 1."""
        return float(self.of(np.array([step]))[0])

    def of(self, steps: np.ndarray) -> np.ndarray:
        """Places of steps (n,), from 0 to 1."""
        found = np.ones(len(steps))
        for number, part in reversed(list(enumerate(self.parts))):
            own = steps <= part.last
            first, last = self._span[number]
            inside = (clock.places(self.run, part, steps[own]) - first) / max(last - first, np.finfo(float).tiny)
            low, high = self._ends[number : number + 2]
            found[own] = low + (high - low) * np.clip(inside, 0.0, 1.0)
        return found

    def parts_of_time(self) -> list[dict[str, Any]]:
        """For the page: mode, ends on the axis and first and last time or step of each part."""
        found = []
        for number, part in enumerate(self.parts):
            start, end = self._ends[number : number + 2].tolist()
            first, last = self._span[number].tolist()
            found.append({"real": part.real, "start": start, "end": end, "first": first, "last": last})
        return found

    def ticks(self) -> Iterator[tuple[float, str]]:
        """Yields places and texts of round numbers: seconds since the part began, or steps."""
        for number, part in enumerate(self.parts):
            (first, last), (low, high) = self._span[number], self._ends[number : number + 2]
            for value in _axis(np.array([first, last]), False)[2]:
                if value >= first:
                    place = low + (high - low) * (value - first) / max(last - first, np.finfo(float).tiny)
                    yield place, f"{value:g} s" if part.real else f"{value:,.0f}"

    def stages(self) -> Iterator[tuple[float, float, str]]:
        """Yields the places of beginning and end of each stage, and its name."""
        starts = [(float(self.of(np.array([step]))[0]), name) for part in self.parts for step, name in part.starts]
        for (start, name), end in zip(starts, [*(place for place, _ in starts[1:]), 1.0], strict=True):
            yield start, end, name


class Plot(NamedTuple):
    """SVG of a plot, and its description for the page: unit, names of the lines, arrays of their points, and its axis."""

    svg: str
    told: dict[str, Any]


def plots(run: Run, packing: Packing) -> list[Plot]:
    """Plots of all histories that change, and of loads over displacements; values of their points are stored in `packing`."""
    axis = Axis(run)
    found = []
    for row in recorded_rows(run):
        lines = [(line.words, *_thin(*run.history(line.name, line.rank))) for line in row.lines]
        found.append(_plot(axis, row, lines, packing))
    return found + [_curve(curve, packing) for curve in load_curves.curves(run)]


def description(run: Run, drawn: list[Plot]) -> dict[str, Any]:
    """Plots and the axis of time for the page."""
    return {"plots": [plot.told for plot in drawn], "time": Axis(run).parts_of_time()}


def _plot(axis: Axis, row: Row, lines: list[tuple[str, np.ndarray, np.ndarray]], packing: Packing) -> Plot:
    inner, tall = WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM
    label, logarithmic = f"{row.words} [{row.unit}]", row.logarithmic
    up, parts = _vertical(np.concatenate([values for _, _, values in lines]), logarithmic, label)
    for start, end, stage in axis.stages():
        x, room = LEFT + inner * start, inner * (end - start)
        parts.append(f'<path class="stage" d="M{x:.1f} {TOP}v{tall}"/>' if start else "")
        parts.append(f'<text x="{x + 3:.1f}" y="{TOP - 3}">{escape(stage)}</text>' if room > 6 * len(stage) else "")
    parts.append(f'<text x="{LEFT - 14}" y="{HEIGHT - 7}" class="left">{_axis_words(axis)}</text>')
    parts += [f'<text x="{LEFT + inner * x:.1f}" y="{HEIGHT - 7}" class="below">{words}</text>' for x, words in axis.ticks()]
    points = []
    for number, (_, steps, values) in enumerate(lines):
        known = _known(values, logarithmic)
        parts.append(_line(number, LEFT + inner * axis.of(steps[known]), up(values[known])))
        points.append([packing.whole(steps[known]), packing.floats(values[known])])
    parts.append(f'<path class="marker" d="M{LEFT} {TOP}v{tall}" data-inner="{inner}"/>')
    names = [words for words, _, _ in lines]
    told = {"unit": row.unit, "names": names, "lines": points, "curve": False, "left": LEFT, "inner": inner}
    return Plot(_svg(label, parts, names), told)


def _axis_words(axis: Axis) -> str:
    return "step" if not any(part.real for part in axis.parts) else "time" if all(part.real for part in axis.parts) else ""


def _curve(curve: load_curves.Curve, packing: Packing) -> Plot:
    """Loads over a motion as an SVG plot."""
    inner = WIDTH - LEFT - RIGHT
    factor, unit = style.readable(curve.y_unit, *curve.y.values())
    scale, x_unit = style.readable(curve.x_unit, curve.x)
    x = scale * curve.x
    label = f"{curve.y_label} [{unit}] over {curve.x_label} [{x_unit}], {curve.title}"
    up, parts = _vertical(factor * np.concatenate(list(curve.y.values())), False, label)
    low, high, ticks = _axis(x, False)

    def across(value: Any) -> Any:
        return LEFT + inner * (value - low) / (high - low)

    parts += [f'<text x="{across(tick):.1f}" y="{HEIGHT - 7}" class="below">{tick:g}</text>' for tick in ticks]
    points = []
    for number, values in enumerate(curve.y.values()):
        known = _known(values, False)
        parts.append(_line(number, across(x[known]), up(factor * values[known])))
        points.append([packing.floats(x[known]), packing.floats(factor * values[known])])
    told = {"unit": unit, "names": list(curve.y), "lines": points, "curve": True}
    return Plot(_svg(label, parts, list(curve.y)), told | {"x": {"name": curve.x_label, "unit": x_unit}})


def _vertical(values: np.ndarray, logarithmic: bool, label: str) -> tuple[Callable[[Any], Any], list[str]]:
    """Function from value to vertical place, and the name and ticks of a plot."""
    low, high, ticks = _axis(values, logarithmic)
    tall = HEIGHT - TOP - BOTTOM

    def up(value: Any) -> Any:
        if logarithmic:
            value = np.log10(np.maximum(value, 10.0**low))
        return TOP + tall * (high - value) / (high - low)

    parts = [f'<text class="name" x="{LEFT}" y="11">{escape(label)}</text>']
    for tick in ticks:
        y = up(tick)
        parts.append(f'<path class="tick" d="M{LEFT} {y:.1f}h{WIDTH - LEFT - RIGHT}"/>')
        parts.append(f'<text x="{LEFT - 5}" y="{y + 3.5:.1f}" class="left">{tick:g}</text>')
    return up, parts


def _known(values: np.ndarray, logarithmic: bool) -> np.ndarray:
    """(n,) whether a value has a place on its axis."""
    return np.isfinite(values) & ((values > 0.0) | (not logarithmic))


def _line(number: int, x: np.ndarray, y: np.ndarray) -> str:
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
    return f'<polyline points="{points}" stroke="{COLOURS[number % len(COLOURS)]}"/>'


def _svg(label: str, parts: list[str], names: list[str]) -> str:
    """A plot with the key of its lines below it."""
    drawn = f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{escape(label)}">{"".join(parts)}</svg>'
    signs = [
        f'<span><i class="line" style="background:{COLOURS[number % len(COLOURS)]}"></i>{escape(name)}</span>'
        for number, name in enumerate(names)
    ]
    return f'<div class="plot">{drawn}<div class="swatches">{"".join(signs)}</div></div>'


def _axis(values: np.ndarray, logarithmic: bool) -> tuple[float, float, list[float]]:
    """Ends of an axis (of the logarithms if `logarithmic`) and the values at its ticks."""
    if logarithmic:
        positive = values[np.isfinite(values) & (values > 0.0)]
        first, last = (floor(log10(positive.min())), ceil(log10(positive.max()))) if len(positive) else (-1, 0)
        last = max(last, first + 1)
        return first, last, [10.0**p for p in range(first, last + 1, max(1, ceil((last - first) / 5)))]
    known = values[np.isfinite(values)]
    low, high = (min(0.0, float(known.min())), float(known.max())) if len(known) else (0.0, 1.0)
    high = high if high > low else low + 1.0
    raw = (high - low) / 4.0
    size = 10.0 ** floor(log10(raw))
    step = next(size * times for times in (1, 2, 5, 10) if size * times >= 0.999 * raw)
    return low, high, [step * k for k in range(ceil(low / step), floor(high / step * 1.000001) + 1)]


def _thin(steps: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A history of at most 2 COLUMNS rows with all peaks."""
    if len(steps) <= 2 * COLUMNS:
        return steps, values
    kept = set()
    for rows in np.array_split(np.arange(len(steps)), COLUMNS):
        kept |= {rows[np.argmin(values[rows])], rows[np.argmax(values[rows])]}
    rows = np.array(sorted(kept))
    return steps[rows], values[rows]
