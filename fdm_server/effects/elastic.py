"""Isotropic linear elasticity (Hooke's law) in plane strain.

With e = d eps_xx + d eps_yy (d eps_zz = 0), K the bulk and G the shear modulus:

    d sigma_xx = (K + 4G/3) d eps_xx + (K - 2G/3) d eps_yy        d sigma_zz = (K - 2G/3) e
    d sigma_yy = (K - 2G/3) d eps_xx + (K + 4G/3) d eps_yy        d sigma_xy = G gamma_xy

Stresses are stored as sm = (xx + yy)/2, sd = (xx - yy)/2, xy and zz. In these the law is diagonal.

A scene gives K and G, or E and nu:

    K = E / (3 (1 - 2 nu)),    G = E / (2 (1 + nu))                              (1)
"""

from typing import ClassVar

from pydantic import model_validator

from coupler_protocol.scene.declare import Effect, quantity, refused

P_WAVE, LAME = 4.0 / 3.0, -2.0 / 3.0  # K + P_WAVE G: constrained modulus; K + LAME G: Lame's lambda
STIFF = (0.5e6, 1e12)  # [Pa] moduli of soil and rock: from peat on
PAIRS = (("bulk", "shear"), ("young", "poisson"))


class Elastic(Effect):
    """Isotropic linear elasticity"""

    source: ClassVar[str] = "Hooke's law in plane strain, e.g. Jaeger, Cook & Zimmerman (2007), Fundamentals of Rock Mechanics"
    bulk: float = quantity(unit="Pa", meaning="bulk modulus K", usual=STIFF, gt=0)
    shear: float = quantity(unit="Pa", meaning="shear modulus G", usual=STIFF, gt=0)
    young: float | None = quantity(None, unit="Pa", meaning="Young's modulus E, with `poisson` instead of bulk and shear", gt=0)
    poisson: float | None = quantity(
        None, meaning="Poisson's ratio nu, with `young`", remedy="use 0.49 for nearly incompressible ground", gt=-1, lt=0.5
    )

    @model_validator(mode="before")
    @classmethod
    def _one_pair(cls, data):
        """Bulk and shear modulus of the pair E, nu, Eqs (1)."""
        given = [key for key in (*PAIRS[0], *PAIRS[1]) if isinstance(data, dict) and data.get(key) is not None]
        if not set(given) & set(PAIRS[1]):
            return data
        if sorted(given) != sorted(PAIRS[1]):
            raise refused(f"{' and '.join(given)}: not a pair of moduli", "give bulk and shear, or young and poisson")
        young, poisson = (data[key] for key in PAIRS[1])
        numbers = all(isinstance(value, int | float) and not isinstance(value, bool) for value in (young, poisson))
        moduli = (1.0, 1.0)  # where the pair itself is wrong, that is what will be said
        if numbers and young > 0.0 and -1.0 < poisson < 0.5:
            moduli = young / (3.0 * (1.0 - 2.0 * poisson)), young / (2.0 * (1.0 + poisson))
        rest = {key: value for key, value in data.items() if key not in PAIRS[1] or not numbers or moduli == (1.0, 1.0)}
        return rest | dict(zip(PAIRS[0], moduli, strict=True))

    @classmethod
    def after_change(cls, before, given):
        """Keys of the table after a change of one or both moduli of a pair: the other one of that pair stays."""
        if not set(given) & set(PAIRS[1]) or not before:
            return before | given
        now = cls.model_validate(before)
        return dict(zip(PAIRS[1], (young_modulus(now), poisson_ratio(now)), strict=True)) | given


def poisson_ratio(elastic):
    """nu [-] of the moduli."""
    return (3.0 * elastic.bulk - 2.0 * elastic.shear) / (2.0 * (3.0 * elastic.bulk + elastic.shear))


def young_modulus(elastic):
    """E [Pa] of the moduli."""
    return 9.0 * elastic.bulk * elastic.shear / (3.0 * elastic.bulk + elastic.shear)


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
