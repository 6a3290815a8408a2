"""Surrogate of a laboratory: Gaussian-process regression (kriging) through all tests, around estimates without a run.

An answer y of the sample of a seed s at the coordinates x, in a short or a full test, is taken as

    y = m(x) + f(x) + b(s) + t d + e                                             (1)

with m the estimate, f its error, b the deviation of the seed's sample (the same for all x: tests of one set of seeds have common
random numbers), t = 1 for a short test and d its bias, and e the noise of one test. f, b, d and e are independent and normal:

    cov f(x), f(x') = O^2 + L^2 (x - x0).(x' - x0) + W^2 exp(-|x - x'|^2 / 2)                            (2)

The mean of f given all tests, by linear algebra, predicts the mean over samples at any x. Sources: Rasmussen & Williams (2006),
Gaussian Processes for Machine Learning, Eqs 2.25, 2.42; Sacks, Welch, Mitchell & Wynn (1989), Stat. Sci. 4, 409-423.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

OFFSET, SLOPE, WAVE = 0.7, 0.4, 0.12  # standard deviations of f of Eq (2), in units of an answer
SEED, SHORT, NOISE = 0.10, 0.15, 0.07  # of b, d and e of Eq (1)


class Observation(NamedTuple):
    """Answers of one sample at one set: coordinates x (d,), seed, whether tests were short, scaled answers y (m,), NaN: none."""

    x: np.ndarray
    seed: int
    short: bool
    y: np.ndarray


class Surrogate:
    """Prediction of scaled answers (m,) at coordinates (d,)."""

    def __init__(
        self, prior: Callable[[np.ndarray], np.ndarray], units: np.ndarray, centre: np.ndarray, data: Sequence[Observation]
    ) -> None:
        """prior: m(x) of Eq (1); units (m,): size of a change of each answer; centre (d,): x0 of Eq (2)."""
        self.prior, self.centre = prior, centre
        self.x = np.array([row.x for row in data])
        seeds = np.array([row.seed for row in data])
        short = np.array([row.short for row in data], dtype=float)
        cov = self._cov(self.x, self.x) + SHORT**2 * np.outer(short, short)
        cov += SEED**2 * (seeds[:, None] == seeds) + NOISE**2 * np.eye(len(data))
        rest = (np.array([row.y for row in data]) - np.array([prior(row.x) for row in data])) / units
        self.short = SHORT**2 * short
        self.weights, self.units = np.zeros((len(data), len(units))), units
        for column, values in enumerate(rest.T):
            known = np.isfinite(values)
            if known.any():
                factor = cho_factor(cov[np.ix_(known, known)])
                self.weights[known, column] = cho_solve(factor, values[known])

    def _cov(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Covariance of f, Eq (2), at coordinates a (n, d) and b (k, d)."""
        apart = ((a[:, None] - b[None]) ** 2).sum(axis=2)
        linear = (a - self.centre) @ (b - self.centre).T
        return OFFSET**2 + SLOPE**2 * linear + WAVE**2 * np.exp(-0.5 * apart)

    def mean(self, x: np.ndarray, short: bool = False) -> np.ndarray:
        """Expected answers (m,) of the mean over samples, of full or short tests."""
        cov = self._cov(np.atleast_2d(x), self.x)[0] + (self.short if short else 0.0)
        return self.prior(x) + self.units * (cov @ self.weights)

    def slopes(self, x: np.ndarray, step: float = 1e-3) -> np.ndarray:
        """(m, d) changes of the answers with a unit of each coordinate."""
        return np.column_stack([(self.mean(x + d) - self.mean(x - d)) / (2.0 * step) for d in step * np.eye(len(x))])
