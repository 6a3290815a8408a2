"""A zone sheared while its cohesion falls with the plastic shear strain.

K = 20 MPa, G = 10 MPa, phi = psi = 0, cohesion from c0 = 100 kPa to c1 = 40 kPa at the plastic shear strain k1 = 0.01, then
constant. The top of one square zone moves sideways, without vertical motion. In simple shear tau = G (gamma - 2 k) until tau
= c0, then tau = c(k), where plane shear by the plastic angle gamma_p gives k = gamma_p/2:

    k = (gamma - c0/G)/(2 - (c0 - c1)/(G k1)),    tau = c0 - (c0 - c1) k/k1            until k = k1, then tau = c1

The strength in a step is that at its beginning, so the error is of first order in the step.
"""

import numpy as np

from verification import as_a_run
from verification.orders import order
from verification.verdict_rows import row

NAME = "softening"
SOURCE = "closed form (simple shear)"
K, G, C0, C1, K1, LAST = 20e6, 10e6, 100e3, 40e3, 0.01, 0.03


def exact(gamma):
    """Shear stress [Pa] at shear strains (n,)."""
    k = np.clip((gamma - C0 / G) / (2.0 - (C0 - C1) / (G * K1)), 0.0, K1)
    return np.where(gamma < C0 / G, G * gamma, C0 - (C0 - C1) * k / K1)


def sheared(steps):
    """Shear strains (n,) and the force on the top [N] after every LOOK-th step."""
    law = {"friction": 0.0, "cohesion": C0}
    soft = {"strain": [K1], "cohesion": [C1]}
    move = {"on": "top", "velocity": {"x": LAST / steps, "y": 0.0}}
    found = as_a_run.compute(
        as_a_run.tables(
            {"kind": "box", "length": 1.0, "height": 1.0, "zone_size": 1.0},
            as_a_run.material(K, G, mohr_coulomb=law, softening=soft),
            [{"name": "shear", "kind": "load", "boundary": [move], "until": {"steps": steps}}],
            {"bottom": "xy"},
        ),
        ["reaction_x:top"],
    )
    force = found.histories["reaction_x:top"]
    return LAST / steps * (as_a_run.LOOK * np.arange(1, len(force) + 1) - 1), force


def rows(fast):
    """The way to a shear of 3 % in 5,000 and 10,000 steps (fast: 1,000 and 2,000)."""
    counts = (1_000, 2_000) if fast else (5_000, 10_000)
    errors = []
    for steps in counts:
        gamma, stress = sheared(steps)
        errors.append(np.abs(stress - exact(gamma)).max() / C0)
    yield row("residual strength [Pa]", stress[-1], C1, 1e-6, SOURCE)
    half = np.searchsorted(gamma, C0 / G + K1 * 0.5 * (2.0 - (C0 - C1) / (G * K1)))
    yield row("strength half-way down [Pa]", stress[half], exact(gamma)[half], 5e-3, SOURCE)
    first = order([1 / steps for steps in counts], errors)
    yield row("largest error along the path over c0", errors[-1], 0.0, 5e-3, SOURCE, first)
