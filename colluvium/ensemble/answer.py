"""What a sweep says: mean, interval, scatter and share of failures of each setting, and what more seeds would give.

The interval of a mean is the 95 % interval of the bootstrap (bias-corrected and accelerated: Efron (1987), J. Am. Stat. Assoc.
82, 171-185, by scipy.stats.bootstrap); with fewer than FEWEST seeds it is that of Student's t. The interval of a share is that
of Wilson (1927), J. Am. Stat. Assoc. 22, 209-212.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from colluvium.ensemble.study import Found

LEVEL = 0.95
FEWEST = 10  # values of fewer are too few for a bootstrap, whose intervals are then too narrow
RESAMPLES = 9999


class Setting(NamedTuple):
    """Values of the keys, and the quantity over the seeds that have it.

    interval: of the mean, None for one seed; share: of the values below a bound, with its interval, None without a bound;
    missing: names of the points without a value, and why.
    """

    values: dict[str, Any]
    seeds: list[int]
    found: list[float]
    mean: float | None
    deviation: float | None
    interval: tuple[float, float] | None
    share: tuple[float, float, float] | None
    missing: list[str]

    @property
    def half_width(self) -> float | None:
        """Half the width of the interval."""
        return None if self.interval is None else 0.5 * (self.interval[1] - self.interval[0])


def settings_of(found: Sequence[Found], quantity: str, below: float | None = None) -> list[Setting]:
    """The settings of a sweep in their order, for one quantity."""
    groups: dict[str, list[Found]] = {}
    for one in found:
        groups.setdefault(repr(one.point.values), []).append(one)
    return [_setting(group, quantity, below) for group in groups.values()]


def _setting(group: Sequence[Found], quantity: str, below: float | None) -> Setting:
    have = [one for one in group if quantity in one.told["values"]]
    numbers = [float(one.told["values"][quantity][0]) for one in have]
    missing = [
        f"{one.point.name}: {one.failed or one.told['lacking'].get(quantity, 'no value')}" for one in group if one not in have
    ]
    mean = float(np.mean(numbers)) if numbers else None
    deviation = float(np.std(numbers, ddof=1)) if len(numbers) > 1 else None
    share = None if below is None or not numbers else share_below(numbers, below)
    return Setting(
        group[0].point.values,
        [one.point.seed for one in have],
        numbers,
        mean,
        deviation,
        interval_of_mean(numbers),
        share,
        missing,
    )


def interval_of_mean(numbers: Sequence[float], random: int = 1) -> tuple[float, float] | None:
    """95 % interval of the mean of a random sample; None for fewer than two values. random: seed of the bootstrap."""
    from scipy import stats

    if len(numbers) < 2:
        return None
    mean, spread = float(np.mean(numbers)), float(np.std(numbers, ddof=1))
    if spread == 0.0:
        return mean, mean
    if len(numbers) < FEWEST:
        half = float(stats.t.ppf(0.5 + 0.5 * LEVEL, len(numbers) - 1)) * spread / math.sqrt(len(numbers))
        return mean - half, mean + half
    found = stats.bootstrap(
        (np.asarray(numbers),), np.mean, confidence_level=LEVEL, n_resamples=RESAMPLES, rng=np.random.default_rng(random)
    ).confidence_interval
    return float(found.low), float(found.high)


def share_below(numbers: Sequence[float], bound: float) -> tuple[float, float, float]:
    """(share of the values below a bound, low and high end of its 95 % interval)."""
    from scipy.stats import binomtest

    count = sum(number < bound for number in numbers)
    interval = binomtest(count, len(numbers)).proportion_ci(LEVEL, method="wilson")
    return count / len(numbers), float(interval.low), float(interval.high)


def by_number_of_seeds(numbers: Sequence[float]) -> list[tuple[int, float, float, float]]:
    """(n, mean, low, high) of the first n values, n from 2: how the mean settles."""
    rows = []
    for n in range(2, len(numbers) + 1):
        low, high = interval_of_mean(numbers[:n]) or (math.nan, math.nan)
        rows.append((n, float(np.mean(numbers[:n])), low, high))
    return rows


def ended_early(found: Sequence[Found]) -> list[str]:
    """What to say of runs that ended by a fault after the slope had failed: their failure gravity counts."""
    early = [one for one in found if one.told.get("ended")]
    if not early:
        return []
    first = early[0]
    runs = "a run" if len(early) == 1 else f"{len(early)} runs"
    return [
        f"{runs} ended by a fault after the slope had failed, with its failure gravity: {first.point.name}: {first.told['ended']}"
    ]


def sentences(settings: Sequence[Setting], quantity: str, below: float | None = None) -> list[str]:
    """What the intervals allow to be said, and what more seeds would give."""
    known = [one for one in settings if one.mean is not None]
    if not known:
        return [f"No point has {quantity}."]
    said = [*_extremes(known, quantity), *_more_seeds(known)]
    if below is not None:
        worst = max(known, key=lambda one: one.share[0] if one.share else 0.0)
        share, low, high = worst.share or (0.0, 0.0, 0.0)
        said.append(
            f"{quantity} is below {below:g} in {100 * share:.0f} % of the seeds at {name_of(worst.values)} "
            f"(95 %: {100 * low:.0f} to {100 * high:.0f} %)."
        )
    return said


def _extremes(known: Sequence[Setting], quantity: str) -> list[str]:
    low, high = (choose(known, key=lambda one: one.mean or 0.0) for choose in (min, max))
    if low is high:
        return [f"{quantity} is {_with_interval(low)}."]
    text = (
        f"{quantity} goes from {_with_interval(low)} at {name_of(low.values)} to {_with_interval(high)} at {name_of(high.values)}"
    )
    if low.interval is None or high.interval is None:
        return [f"{text}; one seed each says nothing of chance: give --seeds."]
    apart = low.interval[1] < high.interval[0]
    return [f"{text}: {'the intervals are apart' if apart else 'the intervals overlap, so this may be chance'}."]


def _more_seeds(known: Sequence[Setting]) -> list[str]:
    """The interval of a mean is proportional to 1/sqrt(n): half of it takes 4 n seeds."""
    wide = [one for one in known if one.half_width]
    if not wide:
        return []
    widest = max(wide, key=lambda one: one.half_width or 0.0)
    more = 3 * len(widest.found)
    return [f"The widest interval is ± {widest.half_width:.2g} at {name_of(widest.values)}: {more} more seeds would halve it."]


def name_of(values: dict[str, Any]) -> str:
    """A setting in words."""
    return ", ".join(
        f"{key} = {value:.4g}" if isinstance(value, float) else f"{key} = {value}" for key, value in values.items()
    ) or ("the scene as it is")


def _with_interval(one: Setting) -> str:
    if one.interval is None:
        return f"{one.mean:.4g}"
    return f"{one.mean:.4g} (95 %: {one.interval[0]:.4g} to {one.interval[1]:.4g}, {len(one.found)} seeds)"


def as_dict(settings: Sequence[Setting]) -> list[dict[str, Any]]:
    """The settings for JSON."""
    return [one._asdict() | {"by_number_of_seeds": by_number_of_seeds(one.found)} for one in settings]


def as_lines(settings: Sequence[Setting], quantity: str) -> list[str]:
    """A table of the settings, and the points without a value."""
    keys = list(settings[0].values)
    head = [*keys, "seeds", quantity, "95 % low", "high", "deviation"]
    rows = [head]
    for one in settings:
        numbers = (one.mean, *(one.interval or (None, None)), one.deviation)
        cells = [f"{value:.4g}" if isinstance(value, float) else str(value) for value in one.values.values()]
        rows.append([*cells, str(len(one.found)), *("-" if number is None else f"{number:.4g}" for number in numbers)])
    widths = [max(len(row[i]) for row in rows) for i in range(len(head))]
    lines = ["  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in rows]
    return [*lines, *(f"no value: {text}" for one in settings for text in one.missing)]
