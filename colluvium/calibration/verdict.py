"""What a calibration found, in words: answers beside targets, and for a target that is missed what would reach it."""

from math import sqrt
from typing import Any, NamedTuple

import numpy as np

from colluvium.calibration.parameters import SYMBOLS, UNITS, Space
from colluvium.calibration.search import SIZES, Outcome
from colluvium.calibration.targets import Goal

MOVES = 0.1  # slope of an answer with a unit of a coordinate, in units of the answer, from which on the parameter moves it
AT_ALL = 0.02  # the same for a parameter at a bound


class Row(NamedTuple):
    """A goal and its answer: mean over seeds, standard deviation (None for one seed), miss in tolerances."""

    goal: Goal
    mean: float
    sd: float | None
    miss: float

    @property
    def reached(self) -> bool:
        """Whether the mean is within the tolerance."""
        return abs(self.miss) <= 1.0


def rows_of(goals: list[Goal], answers: np.ndarray) -> list[Row]:
    """Rows of scaled answers (n, m) of n seeds."""
    found = []
    for goal, column in zip(goals, answers.T, strict=True):
        values = column[np.isfinite(column)]
        if not len(values):
            found.append(Row(goal, float("nan"), None, float("inf")))
            continue
        mean = float(values.mean())
        plain = np.array([goal.plain(v) for v in values])
        sd = float(plain.std(ddof=1)) if len(values) > 1 else None
        found.append(Row(goal, goal.plain(mean), sd, goal.miss(mean)))
    return found


def lines(rows: list[Row], outcome: Outcome, space: Space) -> list[str]:
    """Answers beside targets, then a sentence for each target that is missed."""
    count = len(outcome.seeds)
    text = [f"{'':12}{'target':>12}{'answer':>12}{'± (seeds)':>14}{'off':>9}"]
    for row in rows:
        sd = f"{row.goal.words(row.sd)}" if row.sd is not None else "-"
        text.append(
            f"{row.goal.label:12}{row.goal.words(row.goal.value):>12}{row.goal.words(row.mean):>12}{sd:>14}{_off(row):>9}"
        )
    text.append(f"means over {count} seeds ({', '.join(map(str, outcome.seeds))}); ± is the standard deviation over seeds")
    missed = [row for row in rows if not row.reached]
    if not missed:
        return [*text, "all targets are reached"]
    return [*text, *(sentence for row in missed for sentence in _missed(row, outcome, space))]


def _off(row: Row) -> str:
    if not np.isfinite(row.mean):
        return "-"
    return f"{100.0 * (row.mean / row.goal.value - 1.0):+.1f} %" if row.goal.relative else f"{row.mean - row.goal.value:+.3g}"


def _missed(row: Row, outcome: Outcome, space: Space) -> list[str]:
    """Why a target is missed, and what would reach it."""
    goal, high = row.goal, row.miss > 0.0
    if not np.isfinite(row.mean):
        return [f"{goal.label}: no test has an answer"]
    said = [f"{goal.label} is {goal.words(row.mean)} instead of {goal.words(goal.value)}"]
    if row.sd is not None and abs(row.mean - goal.value) < 2.0 * row.sd / sqrt(len(outcome.seeds)):
        said.append("this is within twice the standard error of the mean: more seeds would tell")
    bounds = _at_bounds(goal, high, outcome, space)
    for name, side in bounds:
        unit = f" {UNITS[name]}" if UNITS[name] else ""
        said.append(f"{SYMBOLS[name]} is at its {side} bound, {outcome.values[name]:.3g}{unit}")
    movers = set(_movers(goal, outcome, space))
    remedies = _remedies(goal, high, {name for name, _ in bounds}, outcome, space)
    said += remedies
    if outcome.ended == "tests" and not bounds:
        said.append("the tests are used up: the same command with a larger calibrate.tests continues")
    elif not bounds and not movers:
        said.append("none of the parameters that vary changes it")
    elif not bounds and not remedies:
        said.append("the targets contradict each other for this packing: what brings this one nearer takes others away")
    return ["; ".join(said)]


def _movers(goal: Goal, outcome: Outcome, space: Space, least: float = MOVES) -> dict[str, float]:
    """Slopes of the answer with the coordinates that move it."""
    index = outcome.goals.index(goal)
    slopes = outcome.surrogate.slopes(space.coordinates(outcome.values))[index] / SIZES.get(goal.name, 1.0)
    return {name: float(s) for name, s in zip(space.names, slopes, strict=True) if abs(s) >= least}


def _at_bounds(goal: Goal, high: bool, outcome: Outcome, space: Space) -> list[tuple[str, str]]:
    """Parameters at a bound beyond which this target would be nearer."""
    found = []
    for name, slope in _movers(goal, outcome, space, AT_ALL).items():
        side = space.at_bound(outcome.values, name)
        if side and (slope > 0.0) == ((side == "upper") != high):
            found.append((name, side))
    return found


def _remedies(goal: Goal, high: bool, bounds: set[str], outcome: Outcome, space: Space) -> list[str]:
    """What would reach a missed target; high: the answer is too high; bounds: parameters that end there."""
    if goal.pressure:
        steepest = goal.pressure == max(other.pressure for other in outcome.goals)
        if steepest and not high and outcome.ended != "tests" and "rolling" not in space.names:
            return ["rolling resistance raises the strength beyond what friction gives: add 'rolling' to calibrate.vary"]
        if high and "friction" in bounds:
            return [
                "less friction than this hardly matters: stones and a dense packing interlock; take fewer stones or more porosity"
            ]
        return [f"wider calibrate.bounds.{name} would bring it nearer" for name in sorted(bounds)]
    if goal.name == "poisson":
        if not high and "ratio" in bounds:
            why = "nu grows as ks/kn falls, and springs of a uniformly strained packing give 0.25 without shear stiffness"
            return [f"{why}; more than that is rearrangement: a lower bound of ratio, a looser packing"]
        if high and "ratio" in bounds:
            return ["nu falls as ks/kn grows: a higher bound of ratio"]
    if goal.name == "dilation":
        return (
            ["dilation follows friction and density: a looser packing (discs.porosity) dilates less"]
            if high
            else ["dilation follows friction and density: a denser packing (discs.porosity) dilates more"]
        )
    return [f"wider calibrate.bounds.{name} would bring it nearer" for name in sorted(bounds)]


def as_json(rows: list[Row]) -> list[dict[str, Any]]:
    """Rows as plain data."""
    return [
        {
            "goal": row.goal.name,
            "target": row.goal.value,
            "tolerance": row.goal.tolerance,
            "mean": row.mean if np.isfinite(row.mean) else None,
            "sd": row.sd,
            "reached": row.reached,
        }
        for row in rows
    ]
