"""Sampling error of means over the contacts of a window: how much another packing of the same kind would differ.

Contacts are not independent. Those of one disc exclude each other, so in a packing of discs of many sizes the directions scatter
less than those of independent contacts; chains of force and crystals of equal discs make values scatter more. Therefore the
error comes from sums over blocks of bodies (discs and whole stones), not from single contacts.

A statistic z has from each contact the influence p_c, sum p_c = 0. Half of it belongs to each of the two bodies. With the
sums P_k over square blocks k, and the shares w_k of the contacts,

    V(L) = sum P_k P_k^T / (1 - sum w_k^2)                                       (1)

is its covariance if blocks of side L are independent, with 1 / sum w_k^2 - 1 degrees of freedom. Neighbouring blocks are
not: what V lacks shrinks with the perimeter of a block over its area, as 1/L, so

    V = V(L) + max(V(L) - V(L/2), 0)                                             (2)

of the traces. V(L) is the mean over SHIFTS^2 shifted nets of blocks. L is SIDE mean distances of bodies, or less for at least
about BLOCKS blocks. A slow change over the window (with depth, or along a band) is not an error: a polynomial of x and y, of
first order or with at least MANY blocks of second order, is fitted to the influences and subtracted. Its m terms cost m of
the f degrees of freedom, and V grows by f / (f - m).

scripts/studies/fabric_study.py measures how often such intervals contain the true value. Sums over blocks: P. Hall, Resampling a
coverage pattern, Stoch. Proc. Appl. 20 (1985) 231-246.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

SIDE = 8.0  # side of a block over the mean distance of bodies
BLOCKS = 9.0  # smallest number of blocks
MANY = 25.0  # blocks from which on a trend of second order is removed
SHIFTS = 4  # shifted nets along each axis
OUTSIDE = 0.05  # share of samples outside an interval


class Spread(NamedTuple):
    """Covariance (2, 2) of the real and imaginary part of an estimate, and its degrees of freedom."""

    covariance: np.ndarray
    freedom: float

    def half_width(self, direction: float) -> float:
        """Half width of the 95 % interval of the component along `direction` [rad]; infinite with fewer than two blocks."""
        from scipy.special import stdtrit

        if self.freedom <= 1.0:
            return float("inf")
        axis = np.array([np.cos(direction), np.sin(direction)])
        return float(stdtrit(self.freedom, 1.0 - OUTSIDE / 2.0) * np.sqrt(axis @ self.covariance @ axis))

    def noise(self) -> float:
        """Absolute value that 95 % of samples with mean zero do not exceed: Hotelling's T^2 of two components, in closed form."""
        if self.freedom <= 1.0:
            return float("inf")
        squared = self.freedom * (OUTSIDE ** (-2.0 / (self.freedom - 1.0)) - 1.0)
        return float(np.sqrt(squared * np.trace(self.covariance) / 2.0))


def spreads(influences: list[np.ndarray], bodies: np.ndarray | None) -> list[Spread]:
    """Spread of each estimate from its complex influences (C,); bodies (C, 2, 2): centres of both bodies of a contact [m].

    Without bodies, contacts are taken as independent.
    """
    count = len(influences[0])
    if bodies is None:
        return [Spread(_outer(p) * count / (count - 1.0), count - 1.0) for p in influences]
    points = np.concatenate((bodies[:, 0], bodies[:, 1]))
    return spreads_of_bodies(np.concatenate((influences, influences), axis=1) / 2.0, points)


def spreads_of_bodies(influences: np.ndarray, points: np.ndarray) -> list[Spread]:
    """Spread of each of q estimates from its complex influences (q, m), each of a body at points (m, 2) [m]."""
    side = block_side(points)
    freedom = _blocks(points, side) - 1.0
    trend = _trend(points, 2 if freedom + 1.0 >= MANY else 1)
    influences = influences.T - trend @ np.linalg.lstsq(trend, influences.T, rcond=None)[0]
    left = freedom - (trend.shape[1] - 1)
    if left <= 1.0:
        return [Spread(np.full((2, 2), np.inf), 1.0) for _ in influences.T]
    both = zip(_of_blocks(points, influences.T, side), _of_blocks(points, influences.T, side / 2.0), strict=True)
    return [Spread(wide * _growth(wide, narrow) * freedom / left, left) for wide, narrow in both]


def block_side(points: np.ndarray) -> float:
    """Side of the blocks [m] for bodies at `points` (m, 2), which may be repeated."""
    size = np.ptp(points, axis=0)
    number = len(np.unique(points[:, 0] + 1j * points[:, 1]))
    side = float(np.sqrt(size.prod())) * min(SIDE / number**0.5, BLOCKS**-0.5)
    return max(side, float(size.max()) / BLOCKS)  # the second: of bodies on a line


def _nets(points: np.ndarray, side: float) -> Iterator[tuple[np.ndarray, float]]:
    """Yields for each shifted net the block (2C,) of each point, and the sum of the squared shares of the blocks."""
    place = (points - points.min(axis=0)) / side
    columns = int(place[:, 1].max()) + 2
    for shift in np.ndindex(SHIFTS, SHIFTS):
        x, y = (place + np.array(shift) / SHIFTS).astype(int).T
        block = x * columns + y
        share = np.bincount(block) / len(points)
        yield block, float(share @ share)


def _blocks(points: np.ndarray, side: float) -> float:
    """Effective number of blocks, mean over the nets."""
    return float(np.mean([1.0 / together for _, together in _nets(points, side)]))


def _of_blocks(points: np.ndarray, values: np.ndarray, side: float) -> np.ndarray:
    """Eq (1) for each row of the complex values (q, 2C), mean over the nets: (q, 2, 2)."""
    total = np.zeros((len(values), 2, 2))
    for block, together in _nets(points, side):
        for V, value in zip(total, values, strict=True):
            sums = np.bincount(block, value.real) + 1j * np.bincount(block, value.imag)
            V += _outer(sums) / max(1.0 - together, 1e-12)
    return total / SHIFTS**2


def _trend(points: np.ndarray, order: int) -> np.ndarray:
    """Polynomials of x and y up to an order, at points (m, 2): (m, 3) or (m, 6)."""
    size = np.ptp(points, axis=0)
    x, y = ((points - points.mean(axis=0)) / np.where(size > 0.0, size, 1.0)).T
    terms = [np.ones_like(x), x, y] + ([x * x, x * y, y * y] if order == 2 else [])
    return np.column_stack(terms)


def _growth(wide: np.ndarray, narrow: np.ndarray) -> float:
    """Factor of Eq (2)."""
    return 2.0 - min(np.trace(narrow) / np.trace(wide), 1.0) if np.trace(wide) > 0.0 else 1.0


def _outer(values: np.ndarray) -> np.ndarray:
    """Sum of the products of real and imaginary parts (2, 2)."""
    parts = np.stack((values.real, values.imag))
    return np.asarray(parts @ parts.T)
