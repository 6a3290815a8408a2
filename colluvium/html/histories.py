"""Histories as small SVG plots, each with a marker that the page moves to the displayed step."""

from html import escape
from math import ceil, floor, log10
from typing import Any

import numpy as np

from colluvium.figures.histories import COLOURS, ROWS
from colluvium.results.run import Run

WIDTH, HEIGHT = 460, 170
LEFT, RIGHT, TOP, BOTTOM = 58, 8, 26, 22  # room around the axes
COLUMNS = 400  # parts of a longer history, of which the smallest and the largest value are kept


def plots(run: Run) -> str:
    """SVG plots of all histories that any rank has."""
    last = max(frame.step for frame in run.frames)
    found = []
    for name, words, logarithmic in ROWS:
        lines = {rank: _thin(*run.history(name, rank)) for rank in run.files if run.has_history(name, rank)}
        lines = {rank: line for rank, line in lines.items() if len(line[0])}
        if lines:
            end = max(last, *(int(steps[-1]) for steps, _ in lines.values()), 1)
            found.append(_plot(run, f"{words} [{run.units(name)}]", lines, logarithmic, end))
    return "\n".join(found)


def _plot(run: Run, label: str, lines: dict[int, tuple[np.ndarray, np.ndarray]], logarithmic: bool, end: int) -> str:
    low, high, ticks = _axis(np.concatenate([values for _, values in lines.values()]), logarithmic)
    inner, tall = WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM

    def across(step: float) -> float:
        return LEFT + inner * step / end

    def up(value: Any) -> Any:
        if logarithmic:
            value = np.log10(np.maximum(value, 10.0**low))
        return TOP + tall * (high - value) / (high - low)

    parts = [f'<text class="name" x="{LEFT}" y="11">{escape(label)}</text>']
    for tick in ticks:
        y = up(tick)
        parts.append(f'<path class="tick" d="M{LEFT} {y:.1f}h{inner}"/><text x="{LEFT - 5}" y="{y + 3.5:.1f}" class="left">')
        parts.append(f"{tick:g}</text>")
    starts = [0, *_stage_starts(run)]
    for start, after, stage in zip(starts, [*starts[1:], end], run.stages, strict=True):
        x, room = across(start), across(after) - across(start)
        parts.append(f'<path class="stage" d="M{x:.1f} {TOP}v{tall}"/>' if start else "")
        parts.append(f'<text x="{x + 3:.1f}" y="{TOP - 3}">{escape(stage)}</text>' if room > 6 * len(stage) else "")
    parts.append(f'<text x="{LEFT - 14}" y="{HEIGHT - 7}" class="left">step</text>')
    for step in _axis(np.array([0.0, end]), False)[2]:
        parts.append(f'<text x="{across(step):.1f}" y="{HEIGHT - 7}" class="below">{step:,.0f}</text>')
    for place, (rank, (steps, values)) in enumerate(lines.items()):
        known = np.isfinite(values) & ((values > 0.0) | (not logarithmic))
        points = " ".join(f"{across(x):.1f},{y:.1f}" for x, y in zip(steps[known], up(values[known]), strict=True))
        colour = COLOURS[rank % len(COLOURS)]
        parts.append(f'<polyline points="{points}" stroke="{colour}"/>')
        side = "grid" if run.files[rank].kind == "continuum" else f"discs, rank {rank}"
        x = WIDTH - RIGHT - 90 * (len(lines) - place - 1)
        parts.append(f'<text x="{x}" y="11" class="left" style="fill:{colour}">{side}</text>')
    marker = f'<path class="marker" d="M{LEFT} {TOP}v{tall}" data-end="{end}" data-inner="{inner}"/>'
    return f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{escape(label)}">{"".join(parts)}{marker}</svg>'


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


def _stage_starts(run: Run) -> list[int]:
    """Steps at which all stages except the first begin: the last steps of the previous stages."""
    return [run.frames[run.last_frame(stage)].step for stage in run.stages[:-1]]
