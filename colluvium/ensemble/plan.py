"""The plan of a sweep: which values of the scene's keys and which seeds are computed, each point one run.

    stones.content=0,.15,.3        values: every combination with those of other keys (grid)
    stones.azimuth.mean=0..90      a range: points of a Latin hypercube, as many as are asked for
    FILE.csv                       a list: one row a point, one column a key, and a column `seed` if seeds are not 1, 2, ..

A table that the value 0 would leave idle is left out: stones.content = 0 is the scene without [stones].

Source of the Latin hypercube: McKay, Beckman & Conover (1979), Technometrics 21, 239-245, by scipy.stats.qmc.
"""

import csv
import math
import re
import tomllib
from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

from coupler_protocol.problems import Problem, SceneError

SEED = "seed"
IDLE = {"stones.content": "stones"}  # keys whose value 0 leaves out a table
_RANGE = re.compile(r"(.+?)\.\.(.+)")


class Axis(NamedTuple):
    """A key of the scene and its values, or the range (low, high) that points of a Latin hypercube cover."""

    key: str
    values: tuple[Any, ...] = ()
    span: tuple[float, float] | None = None


class Point(NamedTuple):
    """One run of a sweep: values of the keys that vary, and the seed."""

    values: dict[str, Any]
    seed: int

    @property
    def name(self) -> str:
        """The point in one line."""
        return ", ".join([*(f"{key} = {_short(value)}" for key, value in self.values.items()), f"seed {self.seed}"])

    @property
    def changes(self) -> list[str]:
        """Overrides of the scene, KEY=VALUE, without tables that the values leave idle (see `tables_left_out`)."""
        given = [f"{key}={_toml(value)}" for key, value in self.values.items() if not _is_idle(key, value)]
        return [*given, f"{SEED}={self.seed}"]

    @property
    def left_out(self) -> list[str]:
        """Tables of the scene that this point does without."""
        return [IDLE[key] for key, value in self.values.items() if _is_idle(key, value)]


def axes_of(texts: Sequence[str]) -> list[Axis]:
    """The axes that texts KEY=VALUES describe; raises SceneError with all that is wrong with them."""
    found, problems = [], []
    for text in texts:
        try:
            found.append(_axis(text))
        except ValueError as error:
            problems.append(_problem(text, str(error), "for example stones.content=0,.15,.3 or stones.azimuth.mean=0..90"))
    keys = [axis.key for axis in found]
    problems += [
        _problem(key, "is given twice", "give all its values once") for key in dict.fromkeys(keys) if keys.count(key) > 1
    ]
    if problems:
        raise SceneError(problems)
    return found


def grid(axes: Sequence[Axis], seeds: Sequence[int]) -> list[Point]:
    """Every combination of the values of all axes with every seed, seeds fastest."""
    return list(_combined(axes, seeds))


def hypercube(axes: Sequence[Axis], number: int, seeds: Sequence[int], random: int) -> list[Point]:
    """Points of a Latin hypercube over the ranges, for every combination of the values of other axes and every seed.

    random: seed of the hypercube. Each of `number` equal parts of a range has one point.
    """
    from scipy.stats import qmc

    ranges = [axis for axis in axes if axis.span is not None]
    unit = qmc.LatinHypercube(d=len(ranges), seed=random).random(number)
    low, high = zip(*(axis.span for axis in ranges if axis.span is not None), strict=True)
    rows = qmc.scale(unit, low, high)
    listed = [axis for axis in axes if axis.span is None]
    return [
        Point({axis.key: chosen.get(axis.key) for axis in axes}, seed)
        for row in rows
        for values in product(*(axis.values for axis in listed))
        for chosen in [
            dict(zip((a.key for a in ranges), map(float, row), strict=True))
            | dict(zip((a.key for a in listed), values, strict=True))
        ]
        for seed in seeds
    ]


def listed(path: str | Path, seeds: Sequence[int]) -> list[Point]:
    """Points of a CSV file; raises SceneError with all rows that cannot be used."""
    try:
        with Path(path).open(newline="", encoding="utf-8-sig") as file:
            rows = list(csv.reader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise SceneError([_problem(str(path), f"cannot be read: {error}", "a CSV file with the keys in its first row")]) from None
    if len(rows) < 2 or not all(name.strip() for name in rows[0]):
        raise SceneError([_problem(str(path), "has no points", "the first row names keys of the scene, each other row a point")])
    names, points, problems = [name.strip() for name in rows[0]], [], []
    if len(set(names)) < len(names):
        raise SceneError([_problem(str(path), "has a column twice", "one column a key")])
    for number, row in enumerate(rows[1:], 2):
        if not any(cell.strip() for cell in row):
            continue
        try:
            if len(row) != len(names):
                raise ValueError(f"has {len(row)} values for {len(names)} keys")
            values = {name: _value(cell.strip()) for name, cell in zip(names, row, strict=True)}
            own = [_seed(values.pop(SEED))] if SEED in values else seeds
        except ValueError as error:
            problems.append(Problem(str(path), number, "", str(error), "one value a key, such as 0.3"))
        else:
            points += [Point(values, seed) for seed in own]
    if problems:
        raise SceneError(problems)
    return points


def without_doubles(points: Sequence[Point]) -> list[Point]:
    """The points, each once, in their order."""
    return list({(repr(point.values), point.seed): point for point in points}.values())


def _combined(axes: Sequence[Axis], seeds: Sequence[int]) -> Iterator[Point]:
    keys = [axis.key for axis in axes]
    for values in product(*(axis.values for axis in axes)):
        for seed in seeds:
            yield Point(dict(zip(keys, values, strict=True)), seed)


def _axis(text: str) -> Axis:
    key, equals, given = (part.strip() for part in text.partition("="))
    if not key or not equals:
        raise ValueError("is not of the form KEY=VALUES")
    if key == SEED:
        raise ValueError("seeds are not a key that varies: use --seeds")
    if (found := _RANGE.fullmatch(given)) and "," not in given:
        low, high = (_number(part) for part in found.groups())
        if not low < high:
            raise ValueError("is no range LOW..HIGH with LOW < HIGH")
        return Axis(key, span=(low, high))
    values = tuple(_value(part.strip()) for part in re.split(r",(?![^\[{]*[\]}])", given) if part.strip())
    if not values:
        raise ValueError("has no values")
    if len({repr(value) for value in values}) < len(values):
        raise ValueError("has a value twice")
    return Axis(key, values)


def _value(text: str) -> Any:
    """A value of TOML; .3 is 0.3, and what is no value of TOML is a text."""
    if re.fullmatch(r"[+-]?\.\d.*", text):
        text = text.replace(".", "0.", 1)
    try:
        value = tomllib.loads(f"v = {text}")["v"]
    except tomllib.TOMLDecodeError:
        if not text:
            raise ValueError("has an empty value") from None
        return text
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f"{text} is not finite")
    return value


def _number(text: str) -> float:
    value = _value(text.strip())
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"{text.strip()!r} is no number")
    return float(value)


def _seed(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise ValueError(f"the seed {value!r} is no integer from 0")
    return value


def _is_idle(key: str, value: Any) -> bool:
    return key in IDLE and not isinstance(value, bool) and value == 0


def _short(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else _toml(value)


def _toml(value: Any) -> str:
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value) if isinstance(value, float) else str(value)


def _problem(text: str, why: str, remedy: str) -> Problem:
    return Problem("--vary", None, text, why, remedy)
