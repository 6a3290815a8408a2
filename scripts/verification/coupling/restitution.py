"""A disc hits the end of a half-infinite bar.

The contact (stiffness k) stops the disc (mass m), and the bar yields by its impedance Z = rho c H: a damped half wave

    m d'' + (k m / Z) d' + k d = 0,    e = exp(-pi b / sqrt(1 - b^2)),    b = sqrt(k m) / 2Z,

at whose end the contact opens with the disc's speed. The bar, too long for the echo of its other end, has columns dx wide and
dx high; the control disc has no mass (the closed form has no mass at the end of the bar). Errors are of order 2 in dx.
"""

import numpy as np

from verification.coupling.bar import DENSITY, SPEED, bar
from verification.verdict_rows import row

NAME = "disc on a bar"
SOURCE = "closed form (dashpot of the bar's impedance)"
SUBSTEPS = (2, 10)
DX, SLOW = 0.05, 1e-5  # speed [m/s] so low that zones and discs keep their places


def restitution(b):
    """Closed form for b < 1."""
    return np.exp(-np.pi * b / np.sqrt(1.0 - b * b))


def rebound(b, fine, share=0.5, half_mass=False, substeps=1):
    """Speed of the disc after the impact over that before, and steps until then; fine: columns to c/omega of the contact.

    substeps: of the disc in a step of the bar.
    """
    impedance = DENSITY * SPEED * DX
    omega = SPEED / (fine * DX)  # sqrt(k / m)
    k, m = 2.0 * b * impedance * omega, 2.0 * b * impedance / omega
    contact = np.pi / (omega * np.sqrt(1.0 - b * b))
    columns = int(0.5 * 1.3 * contact * SPEED / DX) + 4
    joined, _ = bar(columns, DX, 1, k, m, bonded=False, half_mass=half_mass, share=share)
    joined.begin(share, from_rest=False, substeps=substeps)
    joined.discs.v[1, 0] = -SLOW
    steps = 0
    for steps in range(1, 3 * round(contact / joined.grid.dt)):
        joined.step()
        if steps > 3 and not joined.discs.force[1].any():
            break
    return joined.discs.v[1, 0] / SLOW, steps


def rows(fast):
    """Light and heavy discs, and the order of the error, with and without sub-steps."""
    fine = 40 if fast else 80
    for b in (0.05, 0.2, 0.5, 0.8):
        found, _ = rebound(b, fine)
        yield row(f"e, b = {b:g}", found, restitution(b), 1e-3 if fast else 1e-4, SOURCE)
    for n in SUBSTEPS:
        found, _ = rebound(0.2, fine, substeps=n)
        yield row(f"e, b = 0.2, {n} steps of the disc in one", found, restitution(0.2), 1e-3 if fast else 1e-4, SOURCE)
    for n in (1, *SUBSTEPS):
        errors = [abs(rebound(0.2, fine, substeps=n)[0] - restitution(0.2)) for fine in (10, 20, 40)]
        orders = np.log2(np.array(errors[:-1]) / errors[1:])
        words = "" if n == 1 else f", {n} steps of the disc in one"
        yield row(f"order of the error, b = 0.2{words}", orders[-1], 2.0, 0.1, SOURCE, order=orders[-1])
