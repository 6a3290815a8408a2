"""A thick-walled cylinder under pressure from inside: elastic (Lame) and partly plastic (Hill).

Inner radius a = 1 m, outer radius b = 2 m, no load outside; K = 200 MPa, G = 100 MPa, c = 1 MPa, phi = 0. Pressure positive:

    elastic, p below c (1 - a^2/b^2):    sigma_r = p' (b^2/r^2 - 1),    sigma_t = -p' (b^2/r^2 + 1),    p' = p a^2/(b^2 - a^2)
        u(a) = p' a/2G (1 - 2 nu + b^2/a^2)
    plastic up to r = d:                 p = 2 c ln(d/a) + c (1 - d^2/b^2)
        sigma_r = p - 2 c ln(r/a) inside, c (d^2/r^2 - d^2/b^2) outside;    u(b) = (1 - nu) c d^2/(G b)
"""

from math import log

import numpy as np

from verification import as_a_run
from verification.continuum.holes import AXES, norm, polar, ring_grid, seen
from verification.orders import order
from verification.verdict_rows import row

NAME = "thick cylinder"
LAME, HILL = "Lame (1852)", "Hill (1950), The Mathematical Theory of Plasticity, chapter 5"
K, G, COHESION, B, D = 200e6, 100e6, 1e6, 2.0, 1.5
NU = (3 * K - 2 * G) / (2 * (3 * K + G))
ELASTIC = 0.5 * COHESION * (1.0 - 1.0 / B**2)  # [Pa] half the pressure at which the wall yields
PLASTIC = 2.0 * COHESION * log(D) + COHESION * (1.0 - D**2 / B**2)


def solve(n, pressure, steps):
    """The cylinder with n zones to the right angle under a pressure [Pa] that grows ever more slowly in so many steps."""
    law = {"friction": 0.0, "cohesion": COHESION}
    stages = as_a_run.slowing({"on": "inner"}, lambda share: {"pressure": share * pressure}, steps, {"ratio": 1e-7})
    found = as_a_run.compute(as_a_run.tables(ring_grid(n, B), as_a_run.material(K, G, mohr_coulomb=law), stages, AXES))
    return seen(found.model, found.state)


def lame(r):
    """Radial and tangential stress (n,2) [Pa], pressure positive, of the elastic cylinder."""
    p = ELASTIC / (B**2 - 1.0)
    return p * np.column_stack([B**2 / r**2 - 1.0, -(B**2 / r**2) - 1.0])


def hill(r):
    """The same of the partly plastic one."""
    radial = np.where(r < D, PLASTIC - 2.0 * COHESION * np.log(r), COHESION * (D**2 / r**2 - D**2 / B**2))
    return np.column_stack([radial, np.where(r < D, radial - 2.0 * COHESION, -COHESION * (D**2 / r**2 + D**2 / B**2))])


def moved(ring, line):
    """Mean radial displacement [m] of a line of gridpoints."""
    xy = ring.xy[line]
    return float((ring.state.displacement[line] * xy / np.hypot(*xy.T)[:, None]).sum(axis=1).mean())


def rows(fast):
    """12, 24 and 48 zones to the right angle (fast: the two coarse ones)."""
    sizes = (12, 24) if fast else (12, 24, 48)
    h = 1.0 / np.array(sizes)
    rings = [solve(n, ELASTIC, 1_000) for n in sizes]
    errors = [norm(ring, -polar(ring)[:, :2] - lame(ring.radius)) / ELASTIC for ring in rings]
    yield row("elastic: error norm of the stress over p", errors[-1], 0.0, 5e-3, LAME, order(h, errors))
    wall = ELASTIC / (B**2 - 1.0) / (2.0 * G) * (1.0 - 2.0 * NU + B**2)
    found = np.array([moved(ring, ring.wall) for ring in rings])
    yield row("elastic: displacement of the wall [m]", found[-1], wall, 5e-3, LAME, order(h, found - wall))
    rings = [solve(n, PLASTIC, 10_000) for n in sizes]
    errors = [norm(ring, -polar(ring)[:, :2] - hill(ring.radius)) / PLASTIC for ring in rings]
    yield row("plastic to 1.5a: error norm of the stress over p", errors[-1], 0.0, 0.02, HILL, order(h, errors))
    outside = (1.0 - NU) * COHESION * D**2 / (G * B)
    found = np.array([moved(ring, ring.outer) for ring in rings])
    yield row("plastic to 1.5a: displacement outside [m]", found[-1], outside, 0.01, HILL, order(h, found - outside))
