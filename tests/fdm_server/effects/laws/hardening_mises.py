"""A law file as another distribution would bring it: von Mises plasticity with linear hardening, radial return.

With p = (2 sm + zz)/3, the deviator s and J2 = s : s/2,

    sqrt(J2) <= k + H g

where g is the plastic shear angle so far. A trial stress beyond is brought back along its deviator: g grows by
d = (sqrt(J2) - k - H g)/(G + H), and the deviator shrinks to 1 - G d/sqrt(J2) of itself.

In simple shear by the angle c the shear stress is G c up to k, then k + H (G c - k)/(G + H).
"""

from math import sqrt
from typing import ClassVar, NamedTuple

from coupler_protocol.scene.declare import Effect, History, quantity

HISTORIES = (History("mises_strain", "zone", unit="-", meaning="plastic shear angle of von Mises", recorded="mises_strain"),)


class HardeningMises(Effect):
    """Von Mises plasticity with linear hardening"""

    source: ClassVar[str] = "de Souza Neto, Peric & Owen (2008), Computational Methods for Plasticity, section 7.3"
    strength: float = quantity(unit="Pa", meaning="shear strength k at the beginning", gt=0)
    hardening: float = quantity(0.0, unit="Pa", meaning="growth H of the shear strength with the plastic shear angle", ge=0)


class Parameters(NamedTuple):
    """What the law reads in a zone."""

    strength: float  # k [Pa]
    hardening: float  # H [Pa]
    shear: float  # G [Pa]


def parameters(table, elastic):
    """Parameters of one material; no table: infinite strength."""
    if table is None:
        return Parameters(float("inf"), 0.0, elastic.shear)
    return Parameters(table.strength, table.hardening, elastic.shear)


def corrected(sm, zz, sd, xy, g, p):
    """Stresses [Pa] of a triangle and plastic shear angle [-] after the law."""
    mean = (2.0 * sm + zz) / 3.0
    a, b = sm - mean, zz - mean
    size = sqrt(a * a + 0.5 * b * b + sd * sd + xy * xy)
    beyond = size - p.strength - p.hardening * g
    if beyond <= 0.0:
        return sm, zz, sd, xy, g
    d = beyond / (p.shear + p.hardening)
    left = 1.0 - p.shear * d / size
    return mean + left * a, mean + left * b, left * sd, left * xy, g + d
