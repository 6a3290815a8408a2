"""Tension cut-off (Rankine) with associated flow.

No principal stress exceeds the tensile strength st, which is at most the apex c/tan(phi) of a Mohr-Coulomb
material. With s1 <= s2 <= s3 and a1 = K + 4G/3, a2 = K - 2G/3, a trial stress is returned along the elastic
stiffness of the opening:

    one direction opens:     s3 = st,           s1, s2 -= (s3 - st) a2/a1
    two directions open:     s2 = s3 = st,      s1 -= (s2 + s3 - 2 st) a2/(a1 + a2)
    three directions open:   s1 = s2 = s3 = st

It acts after Mohr-Coulomb: it only increases f = s1 - N s3 + C, so the result fulfils both laws.
"""

from typing import ClassVar

from coupler_protocol.scene.declare import Effect, quantity
from fdm_server.effects.elastic import LAME, P_WAVE
from fdm_server.effects.plastic_state import PLASTIC

INF = float("inf")
HISTORIES = (PLASTIC,)


class Tension(Effect):
    """Tension cut-off"""

    source: ClassVar[str] = "Rankine's criterion; Itasca (2011), FLAC 7.0 Constitutive Models"
    strength: float = quantity(unit="Pa", meaning="tensile strength", ge=0)


def parameters(tension, mohr_coulomb, elastic):
    """Arguments (st [Pa], a2/a1, a2/(a1 + a2)) of `cut_off`, for one material; no table: infinite strength."""
    if tension is None:
        return INF, 0.0, 0.0
    apex = INF if mohr_coulomb is None else mohr_coulomb.apex()
    a1 = elastic.bulk + P_WAVE * elastic.shear
    a2 = elastic.bulk + LAME * elastic.shear
    return min(tension.strength, apex), a2 / a1, a2 / (a1 + a2)


def cut_off(s1, s2, s3, strength, one, two):
    """Principal stresses s1 <= s2 <= s3 [Pa] after opening, and whether the zone opens."""
    d3 = s3 - strength
    opens = d3 > 0.0
    p1, p2 = s1 - one * d3, s2 - one * d3

    second = opens & (p2 > strength)
    q1 = s1 - two * (s2 + s3 - 2.0 * strength)

    r1 = q1 if second else p1
    third = second & (r1 > strength)
    r1 = strength if third else r1
    r2 = strength if second else p2
    return (r1 if opens else s1), (r2 if opens else s2), (strength if opens else s3), opens
