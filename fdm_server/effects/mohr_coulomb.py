"""Mohr-Coulomb plasticity with non-associated flow, with exact returns to its edges and apex.

Principal stresses s1 <= s2 <= s3, tension positive; N = (1 + sin phi)/(1 - sin phi), Np the same
with psi, C = 2 c sqrt(N):

    f = s1 - N s3 + C            yield where f < 0
    g = s1 - Np s3               flow, psi <= phi

An elastic trial stress with f < 0 is returned along D dg/ds. With a1 = K + 4G/3 and a2 = K - 2G/3,

    D dg/ds = (a1 - a2 Np,  a2 (1 - Np),  a2 - a1 Np) = (m1, m2, m3)
    s -= lambda m,    lambda = f / (m1 - N m3)                                          one plane active

If this return changes the order of the principal stresses, a second plane is active and the stress is on an edge.
Only the mean t of the two equal stresses is needed; the difference of the two multipliers makes them equal:

    s2 = s3 = t (compression):  L = (s1 - N t + C)/(m1 - N (m2 + m3)/2),  s1 -= L m1,  t -= L (m2 + m3)/2
    s1 = s2 = t (extension):    L = (t - N s3 + C)/((m1 + m2)/2 - N m3),  t -= L (m1 + m2)/2,  s3 -= L m3

An edge ends at the apex s1 = s2 = s3 = C/(N - 1) = c/tan(phi); beyond it all three have this value.
"""

from math import radians, sin, sqrt, tan
from typing import ClassVar

from pydantic import model_validator

from coupler_protocol.scene.declare import Effect, quantity
from fdm_server.effects.elastic import LAME, P_WAVE
from fdm_server.effects.plastic_state import PLASTIC

INF = float("inf")
HISTORIES = (PLASTIC,)


class MohrCoulomb(Effect):
    """Mohr-Coulomb plasticity, non-associated"""

    source: ClassVar[str] = "de Souza Neto, Peric & Owen (2008), Computational Methods for Plasticity"
    friction: float = quantity(
        unit="deg", meaning="friction angle phi", usual=(1.6, 60), remedy="soils have 15 to 45 deg", ge=0, lt=60
    )
    cohesion: float = quantity(unit="Pa", meaning="cohesion c", ge=0)
    dilation: float = quantity(0.0, unit="deg", meaning="dilation angle psi, at most the friction angle", usual=(1.0, 60), ge=0)

    @model_validator(mode="after")
    def _flow_dissipates(self):
        if self.dilation > self.friction:
            raise ValueError(
                f"dilation {self.dilation:g} deg exceeds friction {self.friction:g} deg: such flow "
                f"creates energy; use dilation <= friction"
            )
        return self

    def apex(self):
        """Isotropic tension c/tan(phi) [Pa] without strength; inf without friction."""
        return self.cohesion / tan(radians(self.friction)) if self.friction > 0.0 else INF


def passive_ratio(angle):
    """(1 + sin)/(1 - sin) of an angle [deg]: N of friction, Np of dilation."""
    s = sin(radians(angle))
    return (1.0 + s) / (1.0 - s)


def parameters(mohr_coulomb, elastic):
    """Arguments of `plastic_return` after the stresses, for one material; no table: infinite strength."""
    if mohr_coulomb is None:
        return 1.0, INF, INF, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    N, Np = passive_ratio(mohr_coulomb.friction), passive_ratio(mohr_coulomb.dilation)
    a1 = elastic.bulk + P_WAVE * elastic.shear
    a2 = elastic.bulk + LAME * elastic.shear
    return N, 2.0 * mohr_coulomb.cohesion * sqrt(N), mohr_coulomb.apex(), *directions(N, Np, a1, a2)


def directions(N, Np, a1, a2):
    """Directions of the returns over their denominators [-], arguments of `plastic_return`: p1, p2, p3, c1, c23, e12, e3."""
    m1, m2, m3 = a1 - a2 * Np, a2 * (1.0 - Np), a2 - a1 * Np
    m12, m23 = 0.5 * (m1 + m2), 0.5 * (m2 + m3)
    plane, compression, extension = m1 - N * m3, m1 - N * m23, m12 - N * m3
    return m1 / plane, m2 / plane, m3 / plane, m1 / compression, m23 / compression, m12 / extension, m3 / extension


def plastic_return(s1, s2, s3, N, C, apex, p1, p2, p3, c1, c23, e12, e3):
    """Principal stresses s1 <= s2 <= s3 [Pa] after shear yield, and whether the zone yields.

    N [-], C and apex [Pa] as above; p, c, e [-]: directions of the return to the plane, the compression edge
    and the extension edge over their denominators. Without branches, so that a loop over zones is vectorised.
    """
    f = s1 - N * s3 + C
    q1, q2, q3 = s1 - f * p1, s2 - f * p2, s3 - f * p3

    t = 0.5 * (s2 + s3)
    f_compression = s1 - N * t + C
    k1, k23 = s1 - f_compression * c1, t - f_compression * c23

    u = 0.5 * (s1 + s2)
    f_extension = u - N * s3 + C
    x12, x3 = u - f_extension * e12, s3 - f_extension * e3

    compression, extension = q2 > q3, q1 > q2
    r1 = k1 if compression else (x12 if extension else q1)
    r2 = k23 if compression else (x12 if extension else q2)
    r3 = k23 if compression else (x3 if extension else q3)

    beyond = r3 > apex
    r1 = apex if beyond else r1
    r2 = apex if beyond else r2
    r3 = apex if beyond else r3

    yields = f < 0.0
    return (r1 if yields else s1), (r2 if yields else s2), (r3 if yields else s3), yields
