"""Radii drawn from a grading by stratified sampling: the distribution has as many equal shares as discs, one disc from each.

    r_i = F^-1((i + u_i) / n) / 2,   u_i uniform in [0, 1),   i = 0 .. n-1, in random order                (1)

So also a small number of discs has the grading: the error of its distribution is at most 1/n; independent numbers would have
an error of about 1/sqrt(n) (stratified sampling: McKay, Beckman & Conover 1979, Technometrics 21, 239-245).
F is that of coupler_protocol/scene/tables/grading.py.
"""

import numpy as np
import scipy
import shapely


def radii(number, grading, rng):
    """Radii (number,) [m] of a Grading, Eq (1); rng: numpy Generator."""
    share = (np.arange(number) + rng.random(number)) / max(number, 1)
    return 0.5 * rng.permutation(quantile(grading, share))


def quantile(grading, share):
    """Diameters (n,) [m] that the shares (n,) of the discs do not exceed: F^-1."""
    return _of_lognormal(grading, share) if grading.lognormal else _of_curve(np.array(grading.curve), share)


def _of_lognormal(grading, share):
    mu, a, b = grading.standardised
    low, high = scipy.special.ndtr([a, b])
    size = np.exp(mu + grading.lognormal.sigma * scipy.special.ndtri(low + share * (high - low)))
    return np.clip(size, grading.lognormal.min, grading.lognormal.max)


def _of_curve(points, share):
    """`quantile` of a curve: between two points dF ~ d^-3 dd, so d^-2 is linear in F."""
    inverse, passing = points[:, 0] ** -2.0, points[:, 1]
    number = np.diff(passing) * -np.diff(inverse) / np.diff(np.log(points[:, 0]))  # of discs between two points, up to a factor
    F = np.concatenate([[0.0], np.cumsum(number)]) / number.sum()
    return np.interp(share, F, inverse) ** -0.5


def places(xy, radius, region, rng):
    """Number (n,) of a radius for each of the points xy (n, 2): large radii only at points far enough from the edge.

    A disc of the smallest radius fits anywhere in the region; a larger disc must be farther from the edge by the difference of
    the radii. If no such point remains, the point farthest from the edge is taken.
    """
    depth = shapely.distance(shapely.points(xy), region.boundary)
    order = np.argsort(depth, kind="stable")
    depth, left = depth[order], np.ones(len(xy), dtype=bool)
    given = np.empty(len(xy), dtype=np.int64)
    for k in np.argsort(-radius, kind="stable"):
        deep = np.searchsorted(depth, radius[k] - radius.min())
        there = deep + np.flatnonzero(left[deep:])
        at = rng.choice(there) if len(there) else np.flatnonzero(left)[-1]
        given[order[at]], left[at] = k, False
    return given
