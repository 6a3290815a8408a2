"""Search for parameters whose samples have the targets: a trust-region method on a surrogate of all tests so far.

elastic    kn and ks/kn, by short tests at one stress, which cost a fraction of a full one
strength   all parameters, by full tests at all stresses
check      the answer with other seeds, which give its scatter
refine     if the mean over all seeds misses a target: all parameters again, by tests with all seeds

Each stage repeats: predict the answers by the surrogate (colluvium/calibration/surrogate.py); minimise the sum of

    2 (sqrt(1 + m^2) - 1)     m: miss of a target, in tolerances                 (1)

inside of bounds and of a trust region around the best set (scipy.optimize.least_squares, trust-region reflective, soft_l1); test
this set. Eq (1) is the square of a small miss; a target that cannot be reached does not draw the others from theirs. The region
grows after a set that is better as predicted and shrinks after others. All sets of a stage are tested with the same seeds (common
random numbers). Sources: Conn, Gould & Toint (2000), Trust-Region Methods, ch. 6; Branch, Coleman & Li (1999), SIAM J.
Sci. Comput. 21, 1-23.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

import numpy as np
from scipy.optimize import least_squares

from colluvium.calibration.parameters import SYMBOLS, UNITS, Space, Values
from colluvium.calibration.surrogate import Observation, Surrogate
from colluvium.calibration.targets import Goal

ELASTIC = ("normal", "ratio")
RADIUS, WIDEST, NARROWEST = 0.8, 1.5, 0.04  # of the trust region, in units of coordinates
GROWS, SHRINKS = 1.6, 0.5  # of the radius after a good and a bad prediction
TRUSTED = 0.5  # share of the predicted gain that makes a prediction good
WORTH = 0.9  # predicted sum of Eq (1) over the present one from which on another set is not worth a test
NEAR = 2.0  # tolerances within which moduli are near enough for the stage of strengths, which varies all parameters
VAIN = 3  # sets in a row without a gain that end a stage
START_PULL = 0.1  # tolerances that one unit of a coordinate away from the start counts
SIZES = {"poisson": 0.15, "dilation": 20.0}  # a change of an answer, for the surrogate; 1 for logarithms


class Laboratory(Protocol):
    """Tests of samples."""

    def measure(self, values: Values, seeds: Sequence[int], short: bool) -> dict[int, dict[str, float]]:
        """Answers by the name of the goal, of the sample of each seed; a seed whose tests failed is missing."""

    def cost(self, short: bool) -> int:
        """Number of tests of one sample."""


class NoAnswerError(Exception):
    """No test of the start has an answer."""


class Trial(NamedTuple):
    """A tested set: its number, stage, parameters, seeds, scaled means (m,) of the goals, sum of Eq (1)."""

    number: int
    stage: str
    values: Values
    seeds: tuple[int, ...]
    means: np.ndarray
    merit: float


class Outcome(NamedTuple):
    """Result: the best `values`, scaled answers (n, m) of the `goals` by its `seeds`, trials, number of tests, surrogate, end.

    ended: "reached", "tests" (all are used up), "stationary" (no set is expected to be better), "failed" (answers are missing).
    """

    goals: list[Goal]
    values: Values
    seeds: tuple[int, ...]
    answers: np.ndarray
    trials: list[Trial]
    tests: int
    surrogate: Surrogate
    ended: str


class Search:
    """State of a search: what was tested, and where."""

    def __init__(
        self, space: Space, goals: list[Goal], prior: Callable[[Values], np.ndarray], laboratory: Laboratory, most: int,
        say: Callable[[str], None],
    ) -> None:  # fmt: skip
        """prior(values): estimated scaled answers (m,) of the goals; most: largest number of tests; say(text): progress."""
        self.space, self.goals, self.prior, self.laboratory, self.most, self.say = space, goals, prior, laboratory, most, say
        self.tests = 0
        self.trials: list[Trial] = []
        self.known: dict[tuple[tuple[float, ...], bool], dict[int, np.ndarray]] = {}
        self.centre = space.coordinates(space.start)

    def run(self, seeds: Sequence[int], check: Sequence[int]) -> Outcome:
        """All stages; raises NoAnswerError."""
        free, elastic = np.array([name in ELASTIC for name in self.space.names]), [goal.elastic for goal in self.goals]
        short, best, ended = all(elastic), self.space.start, "stationary"
        if any(elastic) and free.any():
            enough = 1.0 if short else NEAR
            best, ended = self._stage("elastic", best, seeds, np.array(elastic), free, True, enough)
        if not short and ended != "tests":
            every = np.ones(len(self.goals), dtype=bool)
            best, ended = self._stage("strength", best, seeds, every, np.ones(len(free), dtype=bool), False)
        both = (*seeds, *check)
        means = self._test(best, both, short)
        self._note("check", best, both, means, self._merit(means))
        ended = "reached" if self._reached(means) else "tests"
        if ended != "reached" and self._affordable(len(both), short):
            every = np.ones(len(self.goals), dtype=bool)
            best, ended = self._stage("refine", best, both, every, np.ones(len(free), dtype=bool), short)
        answers = self.known[self._key(best, short)]
        rows = np.array([answers[seed] for seed in both if seed in answers])
        there = tuple(seed for seed in both if seed in answers)
        return Outcome(self.goals, best, there, rows, self.trials, self.tests, self._surrogate(), ended)

    def _stage(
        self, stage: str, values: Values, seeds: Sequence[int], goals: np.ndarray, free: np.ndarray, short: bool,
        enough: float = 1.0,
    ) -> tuple[Values, str]:  # fmt: skip
        """Sets of one stage until all misses are below `enough`; goals (m,), free (d,): which ones count and vary.

        Returns the best set and why the stage ended.
        """
        best = values
        means = self._test(values, seeds, short)
        if not np.isfinite(means).any():
            raise NoAnswerError
        merit, radius, vain = self._merit(means, goals), RADIUS, 0
        self._note(stage, values, seeds, means, merit)
        while not self._reached(means, goals, enough):
            if not self._affordable(len(seeds), short):
                return best, "tests"
            wanted, predicted = self._propose(best, goals, free, short, radius)
            if predicted > WORTH * merit or wanted == best:
                return best, "stationary"
            found = self._test(wanted, seeds, short)
            now = self._merit(found, goals)
            self._note(stage, wanted, seeds, found, now)
            good = merit - now > TRUSTED * (merit - predicted) if np.isfinite(merit) else np.isfinite(now)
            radius = min(radius * GROWS, WIDEST) if good else radius * SHRINKS
            vain = 0 if now < merit else vain + 1
            if now < merit:
                best, merit, means = wanted, now, found
            if vain >= VAIN or radius < NARROWEST:
                return best, "stationary" if np.isfinite(merit) else "failed"
        return best, "reached"

    def _propose(
        self, best: Values, goals: np.ndarray, free: np.ndarray, short: bool, radius: float
    ) -> tuple[Values, float]:  # fmt: skip
        """The set that the surrogate expects to be best in the trust region, and its expected sum of Eq (1)."""
        surrogate, here = self._surrogate(), self.space.coordinates(best)
        low, high = self.space.box()
        low, high = np.maximum(low, here - radius)[free], np.minimum(high, here + radius)[free]
        widths = np.array([goal.width for goal in self.goals])[goals]

        def at(part: np.ndarray) -> np.ndarray:
            x = here.copy()
            x[free] = part
            return x

        def misses(part: np.ndarray) -> np.ndarray:
            pull = START_PULL * (part - self.centre[free])
            return np.append(self._misses(surrogate.mean(at(part), short))[goals], pull)

        def slopes(part: np.ndarray) -> np.ndarray:
            moved = surrogate.slopes(at(part))[goals][:, free] / widths[:, None]
            return np.vstack([moved, START_PULL * np.eye(len(part))])

        room = np.maximum(high - low, 1e-9)
        starts = [np.clip(here[free], low, low + room), 0.5 * (low + high)]
        fits = [least_squares(misses, part, slopes, bounds=(low, low + room), loss="soft_l1") for part in starts]
        found = min(fits, key=lambda fit: fit.cost)
        values = self.space.values(at(found.x))
        return values, self._merit(surrogate.mean(self.space.coordinates(values), short), goals)

    def _surrogate(self) -> Surrogate:
        data = [
            Observation(np.array(place), seed, short, y)
            for (place, short), answers in self.known.items()
            for seed, y in answers.items()
        ]
        sizes = np.array([SIZES.get(goal.name, 1.0) for goal in self.goals])
        return Surrogate(lambda x: self.prior(self.space.exact_values(x)), sizes, self.centre, data)

    def _key(self, values: Values, short: bool) -> tuple[tuple[float, ...], bool]:
        return tuple(map(float, self.space.coordinates(values))), short

    def _test(self, values: Values, seeds: Sequence[int], short: bool) -> np.ndarray:
        """Scaled means (m,) over the seeds at a set, with tests of the seeds that it lacks."""
        answers = self.known.setdefault(self._key(values, short), {})
        missing = [seed for seed in seeds if seed not in answers]
        if missing:
            for seed, found in self.laboratory.measure(values, missing, short).items():
                answers[seed] = np.array([goal.scaled(found.get(goal.name, np.nan)) for goal in self.goals])
            self.tests += len(missing) * self.laboratory.cost(short)
        rows = np.array([answers[seed] for seed in seeds if seed in answers])
        if not len(rows):
            return np.full(len(self.goals), np.nan)
        known = np.isfinite(rows)
        return np.where(known.any(axis=0), np.where(known, rows, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1), np.nan)

    def _affordable(self, seeds: int, short: bool) -> bool:
        return self.tests + seeds * self.laboratory.cost(short) <= self.most

    def _misses(self, scaled: np.ndarray) -> np.ndarray:
        return np.array([goal.miss(y) for goal, y in zip(self.goals, scaled, strict=True)])

    def _merit(self, means: np.ndarray, goals: np.ndarray | None = None) -> float:
        """Sum of Eq (1); infinite if an answer is unknown."""
        misses = self._misses(means)[slice(None) if goals is None else goals]
        return float(2.0 * (np.sqrt(1.0 + misses**2) - 1.0).sum()) if np.isfinite(misses).all() else float("inf")

    def _reached(self, means: np.ndarray, goals: np.ndarray | None = None, enough: float = 1.0) -> bool:
        misses = self._misses(means)[slice(None) if goals is None else goals]
        return bool((np.abs(misses) <= enough).all())

    def _note(self, stage: str, values: Values, seeds: Sequence[int], means: np.ndarray, merit: float) -> None:
        """Adds a trial and reports it."""
        self.trials.append(Trial(len(self.trials) + 1, stage, values, tuple(seeds), means, merit))
        answers = ", ".join(
            f"{goal.label} {goal.words(goal.plain(y))}" for goal, y in zip(self.goals, means, strict=True) if np.isfinite(y)
        )
        misses = np.abs(self._misses(means))
        off = f"at most {np.nanmax(misses):.1f} tolerances off" if np.isfinite(misses).any() else "no answer"
        self.say(f"set {len(self.trials)} ({stage}, {len(seeds)} seeds): {in_words(values)}: {answers or 'failed'}: {off}")


def in_words(values: Values) -> str:
    """Parameters as in tables."""
    return ", ".join(f"{SYMBOLS[name]} {value:.4g}{' ' * bool(UNITS[name])}{UNITS[name]}" for name, value in values.items())
