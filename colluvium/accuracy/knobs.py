"""Knobs of a study: keys of a scene, and the values that each takes, from coarse to fine.

    zone_size=0.5,0.25      the values
    zone_size=/1,/2,/4      the scene's value, divided
    zone_size               the scene's value times 2, 1, 1/2, .. as far as the budget goes; exchange_every: 50, 20, .. 1

Keys are those of `--set`, or one of the short names below.
"""

import re
import tomllib
from itertools import product
from typing import Any, NamedTuple

from coupler_protocol.problems import Problem, SceneError

SHORT = {
    "zone_size": "grid.zone_size",
    "radius": "discs.radius",
    "exchange_every": "coupling.exchange_every",
}
STAGES = {"ratio": "until.ratio", "dt": "step_factor"}  # keys of every stage that gives them a value; dt: in real time
TO_ZERO = (".zone_size", ".radius", ".ratio", ".step_factor")  # ends of keys whose value 0 would have no error
SECOND_ORDER = (".zone_size", ".step_factor", ".around")  # formal order of smooth quantities; 1 for the others
COUNTS = (".around",)  # ends of keys that count zones: their reciprocal is a size
INTERVAL, INTERVALS = "coupling.exchange_every", (50, 20, 10, 5, 2, 1)  # more steps between exchanges are coarser
SEED = "seed"
COARSEST, FINEST = 1, 6  # the scene's value of a knob without values: times 2^1, down to times 2^-6


class Knob(NamedTuple):
    """A knob as the user wrote it, the keys that it sets, its values from coarse to fine, and whether these are open.

    open_ended: the knob came without values; a study with a budget chooses how many of them it takes.
    """

    name: str
    keys: tuple[str, ...]
    values: tuple[Any, ...]
    open_ended: bool

    @property
    def to_zero(self) -> bool:
        """Whether the error vanishes as the values go to 0, so that values have a limit."""
        return all(key.endswith(TO_ZERO + COUNTS) for key in self.keys)

    @property
    def formal_order(self) -> float:
        """Order with which the error of a smooth quantity vanishes: 2 for zones and steps, 1 for radii and ratios."""
        return 2.0 if all(key.endswith(SECOND_ORDER) for key in self.keys) else 1.0

    def size(self, value: Any) -> float:
        """A value as a size: the first number of a list, the reciprocal of a count."""
        number = float(value[0] if isinstance(value, list) else value)
        return 1.0 / number if self.keys[0].endswith(COUNTS) else number


class Setting(NamedTuple):
    """One value of each knob, {name: value}, and the overrides of the scene that set them."""

    values: dict[str, Any]
    changes: tuple[str, ...]

    @property
    def name(self) -> str:
        """The setting in one line."""
        return ", ".join(f"{name}={_short(value)}" for name, value in self.values.items()) or "as the scene is"


def knobs_of(texts: list[str], scene: Any) -> list[Knob]:
    """The knobs that texts such as `zone_size=0.5,0.25` describe; raises SceneError with all that is wrong with them."""
    found, problems = [], []
    for text in texts:
        try:
            found.append(_knob(text, scene))
        except ValueError as error:
            problems.append(Problem("--knob", None, text, str(error), "for example --knob zone_size=0.5,0.25 or zone_size=/1,/2"))
    names = [knob.name for knob in found]
    problems += [Problem("--knob", None, n, "is given twice", "give all its values once") for n in {*names} if names.count(n) > 1]
    if problems:
        raise SceneError(problems)
    return found


def seeded(scene: Any, count: int) -> Knob:
    """The knob of `count` seeds, the scene's and those that follow it."""
    return Knob(SEED, (SEED,), tuple(range(scene.seed, scene.seed + count)), False)


def settings_of(knobs: list[Knob]) -> list[Setting]:
    """Every combination of the values of all knobs, the coarsest first."""
    return [setting(knobs, values) for values in product(*(knob.values for knob in knobs))]


def setting(knobs: list[Knob], values: tuple[Any, ...]) -> Setting:
    """The setting with these values, one for each knob."""
    changes = [f"{key}={_toml(value)}" for knob, value in zip(knobs, values, strict=True) for key in knob.keys]
    return Setting({knob.name: value for knob, value in zip(knobs, values, strict=True)}, tuple(changes))


def _knob(text: str, scene: Any) -> Knob:
    name, equals, given = (part.strip() for part in text.partition("="))
    if not name:
        raise ValueError("has no name")
    keys = _keys(name, scene)
    if not equals:
        if keys == (INTERVAL,):
            return Knob(name, keys, INTERVALS, True)
        base, finer = _base(scene, keys[0]), 0.5 if keys[0].endswith(COUNTS) else 2.0
        values = [_divided(base, finer**k) for k in range(-COARSEST, FINEST + 1)]
        return Knob(name, keys, tuple({_toml(value): value for value in values}.values()), True)
    values = [_value(part, scene, keys[0]) for part in _parts(given)]
    if len(values) < 2:
        raise ValueError("has fewer than two values")
    if len({_toml(value) for value in values}) < len(values):
        raise ValueError("has a value twice")
    if keys == (INTERVAL,) and all(isinstance(value, int) for value in values):
        values.sort(reverse=True)
    return Knob(name, keys, tuple(values), False)


def _keys(name: str, scene: Any) -> tuple[str, ...]:
    if name not in STAGES:
        return (SHORT.get(name, name),)
    table, _, key = STAGES[name].rpartition(".")
    holders = [(stage.name, getattr(stage, table) if table else stage) for stage in scene.stage]
    keys = [f"stage.{stage}.{STAGES[name]}" for stage, holder in holders if getattr(holder, key, None) is not None]
    if name == "dt":  # the default of a stage in real time is not written
        keys = [f"stage.{stage.name}.{STAGES[name]}" for stage in scene.stage if stage.in_real_time]
    if not keys:
        why = ": static stages have no time step to choose" if name == "dt" else ""
        raise ValueError(f"no stage of the scene has {STAGES[name]}{why}")
    return tuple(keys)


def _parts(text: str) -> list[str]:
    """The values of a list with commas, which may be lists in brackets themselves."""
    return [part.strip() for part in re.split(r",(?![^\[]*\])", text) if part.strip()]


def _value(text: str, scene: Any, key: str) -> Any:
    if text.startswith("/"):
        return _divided(_base(scene, key), float(text[1:]))
    try:
        return tomllib.loads(f"v = {text}")["v"]
    except tomllib.TOMLDecodeError:
        return text


def _base(scene: Any, key: str) -> Any:
    """The value that a scene has at a key."""
    place = scene.resolved()
    for part in key.split("."):
        if isinstance(place, list):
            place = next((item for item in place if item.get("name") == part), None)
        else:
            place = place.get(part) if isinstance(place, dict) else None
    if isinstance(place, bool) or not isinstance(place, int | float | list):
        raise ValueError(f"the scene gives {key} no number that could be divided")
    return place


def _divided(value: Any, by: float) -> Any:
    if isinstance(value, list):
        return [_divided(one, by) for one in value]
    if isinstance(value, int):
        return max(1, round(value / by))
    return value / by


def _short(value: Any) -> str:
    """A value for people: 0.5 in place of [0.5, 0.5]."""
    same = isinstance(value, list) and len({_toml(one) for one in value}) == 1
    return f"{value[0]:.4g}" if same else _toml(value)


def _toml(value: Any) -> str:
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.12g}" if isinstance(value, float) else str(value)
