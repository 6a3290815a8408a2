"""Sizes of discs: the [discs.grading] table, and its moments.

A grading is a distribution of diameters d. With F(d) the share of the discs, by number, that are not larger:

    lognormal: ln d ~ N(mu, sigma) between min and max,   mu = ln(mean) - sigma^2 / 2               (1)
    curve: shares P of the discs' area that pass d, linear in ln d between the points:
           dF ~ dP / d^2 = P' d^-3 dd                                                               (2)

(1) has the keys of [stones] size; (2) is the sieve curve of soil mechanics, over a logarithmic axis. Moments:

    (1)  E[d^k] = exp(k mu + k^2 sigma^2 / 2) (Phi(b - k sigma) - Phi(a - k sigma)) / (Phi(b) - Phi(a))
    (2)  E[d^k] = S(k - 2) / S(-2),   S(q) = sum P' int d^(q-1) dd                                  (3)

with a, b the standardised logarithms of min and max, and P' = dP / d ln d.
"""

from itertools import pairwise
from math import exp, log
from statistics import NormalDist
from typing import Annotated, Any, cast

from pydantic import AfterValidator, Field, model_validator

from coupler_protocol.scene.declare import Table, quantity
from coupler_protocol.scene.tables.stones import StoneSize

NORMAL = NormalDist()
CurvePoint = tuple[Annotated[float, Field(gt=0)], Annotated[float, Field(ge=0, le=1)]]


def _rising(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    if any(b[0] <= a[0] or b[1] < a[1] for a, b in pairwise(points)):
        raise ValueError("diameters must grow from point to point, and shares must not fall")
    if points[0][1] != 0.0 or points[-1][1] != 1.0:
        raise ValueError("the first share must be 0 and the last one 1")
    return points


Curve = list[tuple[float, float]]


class DiscSize(StoneSize):
    """Lognormal diameters of discs, by number."""


class Grading(Table):
    """Sizes of the discs, instead of uniform radii: either lognormal diameters or a grading curve."""

    lognormal: DiscSize | None = quantity(None, meaning="lognormal diameters")
    curve: Annotated[list[CurvePoint], AfterValidator(_rising)] | None = quantity(
        None,
        unit="m, -",
        meaning="[diameter, area share of the discs that pass it] from share 0 to share 1, linear over the logarithm of the "
        "diameter between points",
        min_length=2,
    )

    @model_validator(mode="after")
    def _one_of_them(self) -> "Grading":
        if (self.lognormal is None) == (self.curve is None):
            raise ValueError("give lognormal = { mean, sigma, min, max } or curve = [[diameter, share], ..], one of them")
        return self

    @property
    def smallest(self) -> float:
        """Smallest radius [m]."""
        return 0.5 * (self.lognormal.min if self.lognormal else cast(Curve, self.curve)[0][0])

    @property
    def largest(self) -> float:
        """Largest radius [m]."""
        return 0.5 * (self.lognormal.max if self.lognormal else cast(Curve, self.curve)[-1][0])

    def moment(self, k: float) -> float:
        """Mean of d^k over the discs, Eq (3) [m^k]."""
        if self.lognormal is None:
            return self._integral(k - 2.0) / self._integral(-2.0)
        s, (mu, a, b) = self.lognormal.sigma, self.standardised
        share = (NORMAL.cdf(b - k * s) - NORMAL.cdf(a - k * s)) / (NORMAL.cdf(b) - NORMAL.cdf(a))
        return exp(k * mu + 0.5 * (k * s) ** 2) * share

    @property
    def standardised(self) -> tuple[float, float, float]:
        """mu, a and b of Eqs (1) and (3)."""
        size = cast(DiscSize, self.lognormal)
        mu = log(size.mean) - 0.5 * size.sigma**2
        return mu, (log(size.min) - mu) / size.sigma, (log(size.max) - mu) / size.sigma

    def _integral(self, q: float) -> float:
        """S(q) of Eq (3)."""
        total = 0.0
        for (d0, p0), (d1, p1) in pairwise(cast(Curve, self.curve)):
            width = log(d1 / d0)
            total += (p1 - p0) / width * (width if q == 0.0 else (d1**q - d0**q) / q)
        return total

    @property
    def mean_radius(self) -> float:
        """Mean radius by number [m]."""
        return 0.5 * self.moment(1.0)


class Uniform:
    """Radii uniform in radius (1 ± spread), with the same properties as a Grading."""

    def __init__(self, radius: float, spread: float) -> None:
        self.mean_radius, self.spread = radius, spread
        self.smallest, self.largest = radius * (1.0 - spread), radius * (1.0 + spread)

    def moment(self, k: int) -> float:
        """Mean of d^k over the discs [m^k], for whole numbers k >= 0."""
        low, high = 2.0 * self.smallest, 2.0 * self.largest
        return sum(low**j * high ** (k - j) for j in range(k + 1)) / (k + 1)


def grading_of(discs: Any) -> Grading | Uniform:
    """The Grading of a scene's `discs` table, or its Uniform radii."""
    return getattr(discs, "grading", None) or Uniform(discs.radius, discs.spread)
