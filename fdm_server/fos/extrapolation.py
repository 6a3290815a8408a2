"""Values on several meshes, extrapolated to zones of no size, with the grid convergence index.

With values f1, f2, f3 on sizes h1 < h2 < h3 and r21 = h2/h1, r32 = h3/h2, the observed order p solves

    (f3 - f2)/(f2 - f1) = r21^p (r32^p - 1)/(r21^p - 1)

(Celik et al. write it with absolute values: values that go away from any limit then show the order of values that approach
one.) With it

    f0 = f1 + (f1 - f2)/(r21^p - 1)        GCI = Fs |f1 - f2|/(r21^p - 1) / |f1|

(Richardson 1911; Roache 1994, J. Fluids Eng. 116; Celik et al. 2008, J. Fluids Eng. 130). Brackets disturb values by about as
much as neighbouring meshes differ, so from four meshes on f0, a and p of f0 + a h^p are fitted to all by least squares (Eca &
Hoekstra 2014, J. Comput. Phys. 262) and GCI = Fs |f1 - f0|/|f1|, which is the same thing on two meshes. Fs = 1.25 with an
observed order. Collapse loads converge with the first order where the mechanism has a slip line, so p = 1 is taken, with Fs = 3,
where there are only two meshes, where the values go to and fro ((f3 - f2)/(f2 - f1) < 0), or where p is above 2.

An observed order below `SLOW` is no property of the slope: the meshes are too coarse, or fit too differently, to show the first
order. Extrapolated with it, the value runs past the right one (1/(r21^p - 1) grows without bound as p falls), and with p = 1 it
may fall short. Such meshes get an interval from the one to the other, in place of a value. Below `SLOWEST` they get neither,
unless it is the brackets that hide a higher order.

For a given p the extrapolated value is a weighted sum of the values, so brackets f_i -+ d_i leave it uncertain by
sum |w_i| d_i besides.
"""

from dataclasses import asdict, dataclass
from itertools import product
from math import log

import numpy as np
from scipy.optimize import brentq, minimize_scalar

SLOWEST, SLOW, FASTEST = 0.5, 0.8, 2.0
FORMAL = 1.0
LEAST, MOST = 1e-3, 20.0  # orders of three meshes
SOUGHT = 0.05, 2.5  # orders among which the best of four and more meshes is sought


@dataclass(frozen=True)
class Extrapolation:
    """Value at zone size 0 or the interval `low`..`high` that it lies in; None for what the meshes do not allow.

    With the order used and observed (None: no three meshes, or none found) and the GCI of the finest mesh, relative.
    """

    value: float | None
    low: float | None
    high: float | None
    order: float
    observed_order: float | None
    safety: float
    gci: float | None
    from_brackets: float | None  # half width that the brackets alone leave; part of low and high

    def as_dict(self):
        """For JSON."""
        return asdict(self)


def extrapolate(sizes, values, half_widths):
    """Extrapolation of `values` (two or more) on meshes of `sizes`, in any order; half_widths: of their brackets."""
    if len(sizes) < 2 or len({*sizes}) != len(sizes):
        raise ValueError(f"extrapolation needs two or more different sizes, not {list(sizes)}")
    h, f, d = np.array(sorted(zip(sizes, values, half_widths, strict=True)), dtype=np.float64).T
    observed = _order(h, f)
    if observed is not None and observed < SLOW:
        return _interval(h, f, d, observed)
    trusted = observed is not None and observed <= FASTEST
    order, safety = (observed, 1.25) if trusted else (FORMAL, 3.0)
    value, uncertain = limit_of_order(h, f, d, order)
    gci = safety * abs(float(f[0]) - value) / abs(float(f[0]))
    return Extrapolation(value, value - uncertain, value + uncertain, order, observed, safety, gci, uncertain)


def _order(h, f):
    """Observed order of values f (n,) on meshes h (n,), or None."""
    return None if len(h) < 3 else observed_order(h, f) if len(h) == 3 else fitted_order(h, f)


def _interval(h, f, d, observed):
    """The Extrapolation of meshes that converge more slowly than SLOW: from the observed order to the formal one, or nothing.

    Where the observed order is below SLOWEST, but values within the brackets f -+ d have a higher one: from SLOWEST to FASTEST.
    """
    orders = observed, FORMAL
    if observed < SLOWEST:
        within = (_order(h, f + d * signs) for signs in product((-1.0, 1.0), repeat=len(h)))
        if not any(order is not None and order >= SLOWEST for order in within):
            return Extrapolation(None, None, None, observed, observed, 3.0, None, None)
        orders = SLOWEST, FASTEST
    limits = [limit_of_order(h, f, d, order) for order in orders]
    low = min(value - uncertain for value, uncertain in limits)
    high = max(value + uncertain for value, uncertain in limits)
    gci = 3.0 * max(abs(float(f[0]) - value) for value, _ in limits) / abs(float(f[0]))
    return Extrapolation(None, low, high, observed, observed, 3.0, gci, max(uncertain for _, uncertain in limits))


def limit_of_order(h, f, d, order):
    """Value at zone size 0 with an order, and the half width that brackets f -+ d leave of it."""
    weight = _weights(h, order)
    return float(weight @ f), float(np.abs(weight) @ d)


def _weights(h, order):
    """Weights w (n,) with which values on meshes h (n,) give f0 of the best f0 + a h^order."""
    return np.linalg.pinv(np.column_stack([np.ones_like(h), h**order]))[0]


def fitted_order(h, f):
    """Order p of the best f0 + a h^p through values f (n,) on meshes h (n,); None where none up to 2.5 is best.

    Where the best is at the lower end of the orders sought, that end: the values fall or rise like log(h), without a limit.
    """

    def misfit(p):
        powers = np.column_stack([np.ones_like(h), h**p])
        return float(np.sum((f - powers @ np.linalg.lstsq(powers, f, rcond=None)[0]) ** 2))

    best = float(minimize_scalar(misfit, bounds=SOUGHT, method="bounded", options={"xatol": 1e-10}).x)
    best = min((best, *SOUGHT), key=misfit)
    return best if best < SOUGHT[1] else None


def observed_order(sizes, values):
    """Order p of three meshes (finest first); None where the values do not approach a limit from one side, or at once.

    0 where they go away from one: neighbours differ by no less, for their sizes, the finer they are.
    """
    (h1, h2, h3), (f1, f2, f3) = map(float, sizes), map(float, values)
    if f2 == f1 or f3 == f2 or (f3 - f2) / (f2 - f1) <= 0.0:
        return None
    r21, r32, shrinks = h2 / h1, h3 / h2, log((f3 - f2) / (f2 - f1))

    def beyond(p):
        return p * log(r21) + log((r32**p - 1.0) / (r21**p - 1.0)) - shrinks  # grows with p

    if beyond(LEAST) >= 0.0:
        return 0.0
    return None if beyond(MOST) <= 0.0 else float(brentq(beyond, LEAST, MOST, xtol=1e-12))
