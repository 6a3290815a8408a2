"""Isotropic linear elasticity (Hooke's law) in plane strain.

With e = d eps_xx + d eps_yy (d eps_zz = 0), K the bulk and G the shear modulus:

    d sigma_xx = (K + 4G/3) d eps_xx + (K - 2G/3) d eps_yy        d sigma_zz = (K - 2G/3) e
    d sigma_yy = (K - 2G/3) d eps_xx + (K + 4G/3) d eps_yy        d sigma_xy = G gamma_xy

Stresses are stored as sm = (xx + yy)/2, sd = (xx - yy)/2, xy and zz. In these the law is diagonal.
"""

from typing import ClassVar

from coupler_protocol.scene.declare import Effect, quantity

P_WAVE, LAME = 4.0 / 3.0, -2.0 / 3.0  # K + P_WAVE G: constrained modulus; K + LAME G: Lame's lambda


class Elastic(Effect):
    """Isotropic linear elasticity"""

    source: ClassVar[str] = "Hooke's law in plane strain, e.g. Jaeger, Cook & Zimmerman (2007), Fundamentals of Rock Mechanics"
    bulk: float = quantity(unit="Pa", meaning="bulk modulus K", gt=0)
    shear: float = quantity(unit="Pa", meaning="shear modulus G", gt=0)


def parameters(elastic):
    """Rows (K + G/3, G, K - 2G/3) [Pa] for the increments below, for one material."""
    K, G = elastic.bulk, elastic.shear
    return K + G / 3.0, G, K + LAME * G


def pressure_increment(dilation, area_modulus, lame):
    """Increments of sm and zz [Pa] for the dilation e [-]."""
    return area_modulus * dilation, lame * dilation


def shear_increment(difference, gamma, shear):
    """Increments of sd and xy [Pa] for d eps_xx - d eps_yy and gamma_xy [-]."""
    return shear * difference, shear * gamma
