"""Limit of a smooth quantity over sizes that go to 0, and the half width of what is known of it.

A smooth quantity (stress, displacement, energy) has the formal order p_f of its scheme, which values on coarse sizes show only in
part. With the observed order p_o, values f1, f2, .. on sizes h1 < h2 < .. and f0 from f0 + a h^p through the two finest of three
values, or closest to all of more:

    |p_o - p_f| <= p_f/10           p = p_f                        U = 1.25 |f1 - f0|
    else                            p = min(max(1/2, p_o), p_f)    U = 3 |f1 - f0|

(Oberkampf & Roy 2010, Verification and Validation in Scientific Computing, for the grid convergence index of Roache 1994,
J. Fluids Eng. 116). To U is added, from four sizes on, the standard deviation of the values from f0 + a h^p (Eca & Hoekstra 2014,
J. Comput. Phys. 262). Values that go to and fro show no order: the finest counts, with three times the range of all values (our
choice; the data range as a measure is that of Eca & Hoekstra 2008, J. Mar. Sci. Technol., doi 10.1007/s00773-008-0018-1). Values
that go away from any limit have none. Collapse loads converge otherwise: fdm_server/fos/extrapolation.py.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fdm_server.fos.extrapolation import SOUGHT, fitted_order, limit_of_order, observed_order

SLOWEST = 0.5
NEAR = 0.1  # share of the formal order within which the observed one confirms it
CONFIRMED, DOUBTED = 1.25, 3.0


class SmoothLimit(NamedTuple):
    """Limit (None: the values have none), half width of what is known of it, observed order (None: none)."""

    value: float | None
    half_width: float
    observed_order: float | None


def smooth_limit(sizes: Sequence[float], values: Sequence[float], half_widths: Sequence[float], formal: float) -> SmoothLimit:
    """Limit of `values` (three or more) on different `sizes`, in any order; half_widths: of what is known of each value."""
    h, f, d = np.array(sorted(zip(sizes, values, half_widths, strict=True)), dtype=np.float64).T
    steps = np.diff(f)
    if not steps.any():
        return SmoothLimit(float(f[0]), float(d[0]), None)
    if steps.min() < 0.0 < steps.max() and _is_to_and_fro(steps):
        return SmoothLimit(float(f[0]), DOUBTED * float(np.ptp(f)) + float(d.max()), None)
    observed = observed_order(h, f) if len(h) == 3 else fitted_order(h, f)
    if observed is not None and observed <= SOUGHT[0]:
        return SmoothLimit(None, 0.0, observed)
    confirmed = observed is not None and abs(observed - formal) <= NEAR * formal
    order = formal if observed is None or confirmed else min(max(SLOWEST, observed), formal)
    used = 2 if len(h) == 3 else len(h)
    value, from_values = limit_of_order(h[:used], f[:used], d[:used], order)
    estimate = (CONFIRMED if confirmed else DOUBTED) * abs(float(f[0]) - value)
    return SmoothLimit(value, estimate + _scatter(h, f, order) + from_values, observed)


def _is_to_and_fro(steps: np.ndarray) -> bool:
    """Whether differences of neighbours change their sign by more than a disturbance of a smooth approach to a limit.

    Of four and more values, one small step back is such a disturbance.
    """
    back, total = float(np.abs(steps).sum() - abs(steps.sum())) / 2.0, float(np.abs(steps).sum())
    return len(steps) < 3 or back > 0.1 * total


def _scatter(h: np.ndarray, f: np.ndarray, order: float) -> float:
    """Standard deviation of values from the best f0 + a h^order; 0 for three values."""
    if len(h) < 4:
        return 0.0
    columns = np.column_stack([np.ones_like(h), h**order])
    rest = f - columns @ np.linalg.lstsq(columns, f, rcond=None)[0]
    return float(np.sqrt(rest @ rest / (len(h) - 2)))
