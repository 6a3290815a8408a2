"""Errors of settings against a reference, the settings on the front of error and time, and the answer in two sentences.

Without a given reference, the value without error is estimated from the finest setting f and, for each knob k whose error
vanishes at 0, the limit f_k of the values along it, with the other knobs at their finest. Factors of safety, and other collapse
loads if the order is given as 1, have it by fdm_server/fos/extrapolation.py, smooth quantities by smooth_limit.py:

    reference = f + sum over k of (f_k - f)

On the front the cost grows as t ~ error^(-1/m): m, the slope of log(error) over log(t) by least squares, says what the next digit
would cost.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from colluvium.accuracy.knobs import SEED, Knob
from colluvium.accuracy.smooth_limit import smooth_limit
from colluvium.accuracy.study import Result
from fdm_server.fos.extrapolation import extrapolate


@dataclass(frozen=True)
class Point:
    """A setting with its mean over seeds: interval is its 95 % half width, or what is known of the value without seeds.

    error: |value - reference| over |reference|, None where it failed or there is no reference; on_front: nothing cheaper is
    better.
    """

    name: str
    values: dict[str, Any]
    value: float | None
    interval: float
    seconds: float | None
    steps: int
    seeds: int
    failed: str
    error: float | None = None
    on_front: bool = False


@dataclass(frozen=True)
class Reference:
    """The value that counts as right, the half width of what is known of it, and where it comes from in words.

    orders: observed order of each knob; itself: the setting that is the reference, whose own error is not known.
    """

    value: float | None
    half_width: float
    source: str
    orders: dict[str, float | None]
    itself: str = ""


def points_of(results: list[Result]) -> list[Point]:
    """One point for each setting: results that differ by the seed alone are one."""
    groups: dict[str, list[Result]] = {}
    for result in results:
        rest = {name: value for name, value in result.values.items() if name != SEED}
        groups.setdefault(repr(rest), []).append(result)
    return [_point(group) for group in groups.values()]


def _point(group: list[Result]) -> Point:
    values = {name: value for name, value in group[0].values.items() if name != SEED}
    name = ", ".join(part for part in group[0].name.split(", ") if not part.startswith(f"{SEED}=")) or group[0].name
    failed = "; ".join(dict.fromkeys(one.failed for one in group if one.failed))
    good = [one for one in group if not one.failed and one.value is not None]
    if failed or not good:
        return Point(name, values, None, 0.0, None, 0, len(group), failed or "no value")
    found = np.array([one.value for one in good], dtype=float)
    interval = max(one.half_width for one in good)
    if len(found) > 1:
        interval += float(stats.t.ppf(0.975, len(found) - 1) * stats.sem(found))
    times = [one.seconds for one in good if one.seconds is not None]
    seconds = float(np.median(times)) if times else None
    return Point(name, values, float(found.mean()), interval, seconds, max(one.steps for one in good), len(group), "")


def reference_of(
    points: list[Point], knobs: list[Knob], given: float | None = None, source: str = "", collapse: bool = False
) -> Reference:
    """The given reference, or the one that the settings extrapolate to; collapse: the quantity is a collapse load."""
    knobs = [knob for knob in knobs if knob.name != SEED]
    orders: dict[str, float | None] = {}
    finest = {knob.name: knob.values[-1] for knob in knobs}
    good = [point for point in points if point.value is not None]
    best = next((point for point in good if point.values == finest), None)
    if best is None or best.value is None:
        why = "the finest setting failed" if any(point.values == finest for point in points) else "there is no finest setting"
        return Reference(given, 0.0, source if given is not None else f"none: {why}", orders)
    value, half_width, parts = best.value, best.interval, []
    for knob in (knob for knob in knobs if knob.to_zero):
        line = [p for p in good if all(p.values[name] == v for name, v in finest.items() if name != knob.name)]
        limit, uncertain, orders[knob.name] = _limit(knob, line, collapse)
        if limit is not None:
            value, half_width = value + limit - best.value, half_width + uncertain
            parts.append(f"{knob.name} -> 0")
    if given is not None:
        return Reference(given, 0.0, source or "given", orders)
    if parts:
        return Reference(value, half_width, f"extrapolated, {', '.join(parts)}", orders)
    return Reference(value, half_width, "the finest setting, whose own error is not known", orders, best.name)


def _limit(knob: Knob, line: list[Point], collapse: bool) -> tuple[float | None, float, float | None]:
    """(limit of the values along a knob, half width, observed order); None for what three or more values do not give."""
    known = [(knob.size(point.values[knob.name]), point.value, point.interval) for point in line if point.value is not None]
    if len(known) < 3:
        return None, 0.0, None
    sizes, values, half_widths = map(list, zip(*known, strict=True))
    if not collapse:
        smooth = smooth_limit(sizes, values, half_widths, knob.formal_order)
        return smooth.value, smooth.half_width, smooth.observed_order
    if max(values) == min(values):
        return values[0], 0.0, None
    found = extrapolate(sizes, values, half_widths)
    if found.value is None:
        return None, 0.0, found.observed_order
    finest = values[sizes.index(min(sizes))]
    return found.value, (found.gci or 0.0) * abs(finest), found.observed_order


def judged(points: list[Point], reference: Reference) -> list[Point]:
    """The points with their errors and whether they are on the front."""
    if reference.value is None:
        return points
    scale = abs(reference.value) or 1.0
    errors = [
        None if point.value is None or point.name == reference.itself else abs(point.value - reference.value) / scale
        for point in points
    ]
    found = []
    for point, error in zip(points, errors, strict=True):
        cheaper = [
            other
            for one, other in zip(points, errors, strict=True)
            if other is not None and one.seconds is not None and point.seconds is not None and one.seconds < point.seconds
        ]
        front = error is not None and point.seconds is not None and all(error < other for other in cheaper)
        found.append(Point(**{**vars(point), "error": error, "on_front": front}))
    return found


def slope(points: list[Point]) -> float | None:
    """m of error ~ t^-m along the front; None without two points with an error, or where the error does not fall."""
    front = sorted((p.seconds, p.error) for p in points if p.on_front and p.error and p.seconds)
    if len(front) < 2:
        return None
    t, e = np.log(np.array(front)).T
    m = -float(np.polyfit(t, e, 1)[0])
    return m if m > 0.0 else None


def sentences(points: list[Point], reference: Reference, target: float) -> list[str]:
    """The cheapest setting that meets the target, and what the next digit would cost."""
    known = [point for point in points if point.error is not None and point.seconds is not None]
    if not known:
        return [f"No setting can be judged: {reference.source}."]
    m, percent = slope(points), f"{100 * target:g} %"
    meeting = [p for p in known if p.error <= target]  # type: ignore[operator]
    if meeting:
        best = min(meeting, key=lambda p: p.seconds)  # type: ignore[arg-type,return-value]
        first = f"The cheapest setting within {percent} is {best.name}: error {_percent(best.error)}, {best.seconds:.3g} s."
        wanted = 0.1 * target
    else:
        best = min(known, key=lambda p: p.error)  # type: ignore[arg-type,return-value]
        first = f"No setting is within {percent}: the best, {best.name}, has {_percent(best.error)} in {best.seconds:.3g} s."
        wanted = target
    return [first, _next_digit(known, best, wanted, m), *_doubts(reference, wanted)]


def _next_digit(known: list[Point], best: Point, wanted: float, m: float | None) -> str:
    """What an error of `wanted` costs: a setting that has it, else by the slope of the front."""
    what = f"An error of {100 * wanted:.2g} %"
    there = [p for p in known if p.error <= wanted]  # type: ignore[operator]
    if there:
        cheapest = min(there, key=lambda p: p.seconds)  # type: ignore[arg-type,return-value]
        if cheapest is best:
            return f"It is within {100 * wanted:.2g} % as well."
        return f"{what} costs {cheapest.seconds:.3g} s ({cheapest.name}), {_times(cheapest.seconds, best.seconds)} as much."
    if m is None or not best.error or best.seconds is None:
        return f"{what} is not reached, and the settings do not show what it would cost: add finer ones."
    seconds = best.seconds * (best.error / wanted) ** (1.0 / m)
    return f"{what} would cost about {seconds:.2g} s, {_times(seconds, best.seconds)} as much: the error falls as time^-{m:.2g}."


def _times(seconds: float | None, base: float | None) -> str:
    return f"{(seconds or 0.0) / (base or 1.0):.2g} times"


def _percent(error: float | None) -> str:
    return f"{100 * (error or 0.0):.2g} %"


def _doubts(reference: Reference, wanted: float) -> list[str]:
    """A sentence where the reference is known less well than errors are asked for."""
    if not reference.value or reference.half_width <= wanted * abs(reference.value):
        return []
    share = reference.half_width / abs(reference.value)
    return [
        f"The reference itself ({reference.source}) is known within {_percent(share)} only: smaller errors are not told apart."
    ]


def as_lines(quantity: str, points: list[Point], reference: Reference, target: float) -> list[str]:
    """The table and the sentences as lines of text."""
    width = max(len("setting"), *(len(point.name) for point in points))
    lines = [f"{'setting':{width}} {'value':>12} {'± 95 %':>9} {'error [%]':>9} {'steps':>9} {'seconds':>8}  front"]
    for p in points:
        if p.failed:
            lines.append(f"{p.name:{width}} failed: {p.failed}")
            continue
        error = "" if p.error is None else f"{100 * p.error:.3g}"
        seconds = "" if p.seconds is None else f"{p.seconds:.3g}"
        interval = f"{p.interval:.2g}" if p.interval else ""
        front = "  *" if p.on_front else ""
        lines.append(f"{p.name:{width}} {p.value:12.6g} {interval:>9} {error:>9} {p.steps:9d} {seconds:>8}{front}")
    if reference.value is not None:
        within = f" ± {reference.half_width:.2g}" if reference.half_width else ""
        lines.append(f"reference: {quantity} = {reference.value:.6g}{within} ({reference.source})")
    found = [f"{name} {order:.2f}" for name, order in reference.orders.items() if order is not None]
    if found:
        lines.append(f"observed order: {', '.join(found)}")
    return [*lines, *sentences(points, reference, target)]
