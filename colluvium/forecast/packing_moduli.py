"""Moduli and strength of a packing, estimated from its contacts without a run.

With z contacts a disc, porosity n, and springs kn, ks of the contacts (Bathurst & Rothenburg 1988, J. Appl. Mech. 55, 17-23,
under uniform strain; sum d^2 / A = 2 z (1 - n) / pi for discs of one size):

    K2 = kn z (1 - n) / 2 pi,    G = (kn + ks) z (1 - n) / 4 pi                  (1)

in plane strain. For the hexagonal packing (z = 6, 1 - n = pi / 2 sqrt(3)) this is exact: K2 = sqrt(3)/2 kn,
G = sqrt(3)/4 (kn + ks). Random packings rearrange and are softer, above all in shear. The plane gives

    E2 = 4 K2 G / (K2 + G),   nu2 = (K2 - G) / (K2 + G),   nu = nu2 / (1 + nu2),   E = E2 (1 - nu^2)        (2)

with E2, nu2 of a test in the plane and E, nu of the material in three dimensions in plane strain. Strength:

    sin(phi) = 0.85 sin(atan mu),   pt = Fnb z (1 - n) / 2 pi R,   q = 2 sin(phi) / (1 - sin(phi)) (p + pt)  (3)

as for windows (dem_server/insitu/packing_strength.py): pt is the isotropic tension that breaks all bonds, q the largest
difference of the principal stresses at the smaller pressure p. A content C of rigid stones divides the moduli by 1 - C and
raises the sine to (1 - C) sin(phi) + C.
"""

from math import atan, pi, sin
from typing import Any, NamedTuple

COORDINATION = 4.2  # of a packing without friction under pressure
ROLLING = 0.85  # sine of the packing's friction angle over sine of the contacts'
SMOOTH = 0.05  # least sine of discs without friction


class Estimate(NamedTuple):
    """Estimated moduli [Pa] and strength of a packing: `bulk` K2 and `shear` G in the plane, sine of phi, `tension` pt [Pa]."""

    bulk: float
    shear: float
    sine: float
    tension: float

    @property
    def young_plane(self) -> float:
        """E2 [Pa] of Eq (2)."""
        return 4.0 * self.bulk * self.shear / (self.bulk + self.shear)

    @property
    def constrained(self) -> float:
        """Modulus under one-dimensional strain, K2 + G [Pa]."""
        return self.bulk + self.shear

    def strength(self, pressure: float) -> float:
        """q of Eq (3) [Pa] at the smaller principal pressure [Pa]."""
        return 2.0 * self.sine / (1.0 - self.sine) * (pressure + self.tension)


class Solid(NamedTuple):
    """Young's modulus [Pa] and Poisson's ratio in three dimensions, of plane strain."""

    young: float
    poisson: float


def solid_of_plane(young: float, poisson: float) -> Solid:
    """The three-dimensional moduli of those measured in the plane, Eq (2)."""
    nu = poisson / (1.0 + poisson)
    return Solid(young * (1.0 - nu * nu), nu)


def estimate(discs: Any, content: float = 0.0) -> Estimate:
    """Estimate for the scene's table `discs` with a content of stones, Eqs (1) and (3)."""
    soil = discs.soil
    own = next((pair for pair in discs.pair if set(pair.between) == {"soil"}), None)
    spring = (own and own.spring) or soil.spring
    series = 0.5 if discs.stiffness == "disc" and not (own and own.spring) else 1.0
    friction, bond = (own and own.friction) or soil.friction, (own and own.bond) or soil.bond
    dense = COORDINATION * (1.0 - discs.porosity) / (2.0 * pi)
    normal, shear = series * spring.normal, series * spring.shear
    sine = max(SMOOTH, ROLLING * sin(atan(friction.coefficient)) if friction else 0.0)
    tension = dense * bond.tension / discs.radius if bond else 0.0
    sine = (1.0 - content) * sine + content
    return Estimate(dense * normal / (1.0 - content), 0.5 * dense * (normal + shear) / (1.0 - content), sine, tension)
