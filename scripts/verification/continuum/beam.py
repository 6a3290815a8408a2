"""A cantilever bent by a shear stress on its end: bending of quadrilaterals.

Length 10 m, depth d = 1 m, K = 5 GPa, G = 3 GPa, shear stress 10 kPa on the end, plane strain. Timoshenko's beam with E' = E/(1
- nu^2), P = 10 kPa d, I = d^3/12:

    deflection of the end:   P L^3/(3 E' I) + 6 P L/(5 G d)

Beam theory itself is accurate to a few tenths of a per cent here (the held end cannot contract).
"""

import numpy as np

from verification import as_a_run
from verification.orders import order
from verification.verdict_rows import row

NAME = "cantilever"
SOURCE = "Timoshenko & Goodier (1970), Theory of Elasticity, section 21"
K, G, SHEAR, LENGTH = 5e9, 3e9, 10e3, 10.0
NU = (3 * K - 2 * G) / (2 * (3 * K + G))
DEFLECTION = SHEAR * LENGTH**3 * 12.0 * (1.0 - NU) / (3.0 * 2.0 * G) + 6.0 * SHEAR * LENGTH / (5.0 * G)


def bent(parts):
    """Deflection [m] of the end with so many zones to the depth."""
    found = as_a_run.compute(
        as_a_run.tables(
            {"kind": "box", "length": LENGTH, "height": 1.0, "zone_size": 1.0 / parts},
            as_a_run.material(K, G),
            [{"name": "bend", "kind": "load", "until": {"ratio": 1e-7}}],
            [{"on": "left", "fix": "xy"}, {"on": "right", "stress": {"xy": SHEAR}}],
        )
    )
    return found.state.displacement[found.model.grid.xy[:, 0] == LENGTH, 1].mean()


def rows(fast):
    """4, 8 and 16 zones to the depth (fast: 4 and 8)."""
    counts = (4, 8) if fast else (4, 8, 16)
    found = np.array([bent(parts) for parts in counts])
    observed = None if fast else order(1.0 / np.array(counts[:-1]), np.abs(np.diff(found)))
    for parts, value in zip(counts, found, strict=True):
        shown = observed if parts == counts[-1] else None
        yield row(f"deflection, {parts} zones deep [m]", value, DEFLECTION, 0.4 / parts, SOURCE, shown)
