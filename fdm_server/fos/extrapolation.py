"""Values on several meshes, extrapolated to zones of no size, with the grid convergence index.

With values f1, f2, f3 on sizes h1 < h2 < h3 and r21 = h2/h1, r32 = h3/h2, the observed order p solves

    p = |ln|(f3 - f2)/(f2 - f1)| + q(p)| / ln r21,    q(p) = ln((r21^p - s)/(r32^p - s)),    s = sign((f3 - f2)/(f2 - f1))

and with it

    f0 = f1 + (f1 - f2)/(r21^p - 1)        GCI = Fs |f1 - f2|/(r21^p - 1) / |f1|

(Richardson 1911; Roache 1994, J. Fluids Eng. 116; Celik et al. 2008, J. Fluids Eng. 130). Fs = 1.25 with an observed order.
Collapse loads converge with the first order where the mechanism has a slip line, so p = 1 is taken, with Fs = 3, where there
are only two meshes, where the values do not approach anything (s < 0), or where p falls outside .5 to 2.

Values are known within brackets: with f1 +- d1 and f2 +- d2, the extrapolated value is uncertain by
d1 + (d1 + d2)/(r21^p - 1) besides.
"""

from dataclasses import asdict, dataclass
from math import log

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
    meshes = sorted(zip(sizes, values, half_widths, strict=True))
    (h1, f1, d1), (h2, f2, d2) = meshes[:2]
    observed = observed_order([m[0] for m in meshes[:3]], [m[1] for m in meshes[:3]]) if len(meshes) > 2 else None
    trusted = observed is not None and TRUSTED[0] <= observed <= TRUSTED[1]
    order, safety = (observed, 1.25) if trusted else (FORMAL, 3.0)
    gain = 1.0 / ((h2 / h1) ** order - 1.0)
    return Extrapolation(
        value=f1 + gain * (f1 - f2),
        order=order,
        observed_order=observed,
        safety=safety,
        gci=safety * gain * abs((f1 - f2) / f1),
        from_brackets=d1 + gain * (d1 + d2),
    )


def observed_order(sizes, values):
    """Order p of three meshes (finest first), or None where the values do not approach a limit."""
    (h1, h2, h3), (f1, f2, f3) = sizes, values
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
