"""Values on several meshes, extrapolated to zones of no size, with the grid convergence index.

With values f1, f2, f3 on sizes h1 < h2 < h3 and r21 = h2/h1, r32 = h3/h2, the observed order p solves

    p = |ln|(f3 - f2)/(f2 - f1)| + q(p)| / ln r21,    q(p) = ln((r21^p - s)/(r32^p - s)),    s = sign((f3 - f2)/(f2 - f1))

and with it

    f0 = f1 + (f1 - f2)/(r21^p - 1)        GCI = Fs |f1 - f2|/(r21^p - 1) / |f1|

(Richardson 1911; Roache 1994, J. Fluids Eng. 116; Celik et al. 2008, J. Fluids Eng. 130). Brackets disturb values by about as
much as neighbouring meshes differ, so from four meshes on f0, a and p of f0 + a h^p are fitted to all by least squares (Eca &
Hoekstra 2014, J. Comput. Phys. 262) and GCI = Fs |f1 - f0|/|f1|, which is the same thing on two meshes. Fs = 1.25 with an
observed order. Collapse loads converge with the first order where the mechanism has a slip line, so p = 1 is taken, with Fs = 3,
where there are only two meshes, where the values do not approach anything (s < 0), or where p falls outside .5 to 2.

For a given p the extrapolated value is a weighted sum of the values, so brackets f_i -+ d_i leave it uncertain by
sum |w_i| d_i besides.
"""

from dataclasses import asdict, dataclass
from math import log

import numpy as np
from scipy.optimize import minimize_scalar

TRUSTED = 0.5, 2.0
FORMAL = 1.0


@dataclass(frozen=True)
class Extrapolation:
    """Value at no zone size; order used and observed (None: no three meshes, or none found); GCI of the finest mesh, relative."""

    value: float
    order: float
    observed_order: float | None
    safety: float
    gci: float
    from_brackets: float  # half width that the brackets alone leave

    def as_dict(self):
        """For JSON."""
        return asdict(self)


def extrapolate(sizes, values, half_widths):
    """Extrapolation of `values` (two or more) on meshes of `sizes`, in any order; half_widths: of their brackets."""
    if len(sizes) < 2 or len({*sizes}) != len(sizes):
        raise ValueError(f"extrapolation needs two or more different sizes, not {list(sizes)}")
    h, f, d = np.array(sorted(zip(sizes, values, half_widths, strict=True)), dtype=np.float64).T
    observed = None if len(h) < 3 else observed_order(h, f) if len(h) == 3 else fitted_order(h, f)
    trusted = observed is not None and TRUSTED[0] <= observed <= TRUSTED[1]
    order, safety = (observed, 1.25) if trusted else (FORMAL, 3.0)
    weight = _weights(h, order)
    value = float(weight @ f)
    return Extrapolation(
        value=value,
        order=order,
        observed_order=observed,
        safety=safety,
        gci=safety * abs(float(f[0]) - value) / abs(float(f[0])),
        from_brackets=float(np.abs(weight) @ d),
    )


def _weights(h, order):
    """Weights w (n,) with which values on meshes h (n,) give f0 of the best f0 + a h^order."""
    return np.linalg.pinv(np.column_stack([np.ones_like(h), h**order]))[0]


def fitted_order(h, f):
    """Order p of the best f0 + a h^p through values f (n,) on meshes h (n,); None where none between .5 and 2 is best."""

    def misfit(p):
        powers = np.column_stack([np.ones_like(h), h**p])
        return float(np.sum((f - powers @ np.linalg.lstsq(powers, f, rcond=None)[0]) ** 2))

    best = float(minimize_scalar(misfit, bounds=TRUSTED, method="bounded", options={"xatol": 1e-10}).x)
    return best if misfit(best) < min(misfit(p) for p in TRUSTED) else None


def observed_order(sizes, values):
    """Order p of three meshes (finest first), or None where the values do not approach a limit."""
    (h1, h2, h3), (f1, f2, f3) = map(float, sizes), map(float, values)
    if f2 == f1 or f3 == f2 or (f3 - f2) / (f2 - f1) <= 0.0:
        return None
    r21, r32 = h2 / h1, h3 / h2
    p = 1.0
    for _ in range(200):
        q = log((r21**p - 1.0) / (r32**p - 1.0))
        new = abs(log((f3 - f2) / (f2 - f1)) + q) / log(r21)
        if new < 1e-3 or new > 20.0:
            return None
        if abs(new - p) < 1e-12:
            return new
        p = 0.5 * (p + new)
    return p
