"""Histories as small SVG plots, each with a marker that the page moves to the displayed step."""

from collections.abc import Callable, Iterator
from html import escape
from math import ceil, floor, log10
from typing import Any

import numpy as np

from colluvium.figures import style
from colluvium.figures.histories import COLOURS, NARROWEST, recorded_rows
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


def plots(run: Run) -> str:
    """SVG plots of all histories that change, and of loads over displacements."""
    axis = Axis(run)
    found = []
    for row in recorded_rows(run):
        lines = [(line.words, *_thin(*run.history(line.name, line.rank))) for line in row.lines]
        found.append(_plot(axis, f"{row.words} [{row.unit}]", lines, row.logarithmic))
    found += [_curve(curve) for curve in load_curves.curves(run)]
    return "\n".join(found)


def _plot(axis: Axis, label: str, lines: list[tuple[str, np.ndarray, np.ndarray]], logarithmic: bool) -> str:
    inner, tall = WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM
    up, parts = _vertical(np.concatenate([values for _, _, values in lines]), logarithmic, label)
    for start, end, stage in axis.stages():
        x, room = LEFT + inner * start, inner * (end - start)
        parts.append(f'<path class="stage" d="M{x:.1f} {TOP}v{tall}"/>' if start else "")
        parts.append(f'<text x="{x + 3:.1f}" y="{TOP - 3}">{escape(stage)}</text>' if room > 6 * len(stage) else "")
    parts.append(f'<text x="{LEFT - 14}" y="{HEIGHT - 7}" class="left">{_axis_words(axis)}</text>')
    parts += [f'<text x="{LEFT + inner * x:.1f}" y="{HEIGHT - 7}" class="below">{words}</text>' for x, words in axis.ticks()]
    for number, (_, steps, values) in enumerate(lines):
        parts.append(_line(number, LEFT + inner * axis.of(steps), values, up, logarithmic))
    parts.append(f'<path class="marker" d="M{LEFT} {TOP}v{tall}" data-inner="{inner}"/>')
    return _svg(label, parts, [words for words, _, _ in lines])


def _axis_words(axis: Axis) -> str:
    return "step" if not any(part.real for part in axis.parts) else "time" if all(part.real for part in axis.parts) else ""


def _curve(curve: load_curves.Curve) -> str:
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
    parts += [_line(number, across(x), factor * values, up, False) for number, values in enumerate(curve.y.values())]
    return _svg(label, parts, list(curve.y))


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


def _line(number: int, x: np.ndarray, values: np.ndarray, up: Callable[[Any], Any], logarithmic: bool) -> str:
    known = np.isfinite(values) & ((values > 0.0) | (not logarithmic))
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x[known], up(values[known]), strict=True))
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
