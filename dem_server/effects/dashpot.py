"""Viscous dashpots beside the springs of a contact, given by the fraction of critical damping.

    cn = 2 beta_n sqrt(m kn),   cs = 2 beta_s sqrt(m ks),   m = mi mj / (mi + mj)     (1)
    Fn' = Fn - cn vn,           Fs' = Fs - cs vs                                      (2)

vn: rate of the gap, vs: rate of slip; m of a disc in a clump is the clump's mass, that of a held disc
infinite. With `tension = false` Fn' is not allowed to pull: Fn' >= 0. In slip |Fs'| <= mu Fn. The limits of
friction and bonds are those of the spring forces, and so are the recorded forces. In static mode
masses and velocities are those of the scaled motion.

Two discs that collide part with e times their speed: with tension e = exp(-pi beta / sqrt(1 - beta^2)), without
e = exp(-beta / sqrt(1 - beta^2) (pi - atan2(2 beta sqrt(1 - beta^2), 1 - 2 beta^2))).
Sources: Schwager & Poeschel (2007), Granular Matter 9, 465-469 (both e); Itasca, PFC2D 3.1 Theory, "Mechanical
damping".
"""

from typing import ClassVar, NamedTuple

import numpy as np

from coupler_protocol.scene.declare import Effect, History, quantity
from dem_server.effects.pairs import by_kind


class Dashpot(Effect):
    """viscous dashpots at the contacts"""

    source: ClassVar[str] = "Schwager & Poeschel (2007), Granular Matter 9, 465-469"
    normal: float = quantity(meaning="fraction of critical damping of the gap; the smaller one of a pair counts", ge=0, le=10)
    shear: float = quantity(0.0, meaning="fraction of critical damping of slip; the smaller one of a pair counts", ge=0, le=10)
    tension: bool = quantity(False, meaning="the normal dashpot may pull at a contact that is not bonded")


HISTORIES = (History("root_mass", "pair", unit="kg^0.5", meaning="sqrt(m) of Eqs (1), set with the masses of the discs"),)


class DashpotTable(NamedTuple):
    """Of each kind of pair: `normal`, `shear` (kinds,): 2 beta sqrt(k) [sqrt(N/m)]; `tension` (kinds,): may pull."""

    normal: np.ndarray
    shear: np.ndarray
    tension: np.ndarray


def dashpot_table(pairs, spring):
    """Table of the kinds of pairs with the stiffnesses `spring`; a disc without dashpots has none with others either."""
    found = by_kind(pairs, "dashpot", weaker)
    if found is None:
        return None
    beta = np.array([(table.normal, table.shear) if table else (0.0, 0.0) for table in found])
    return DashpotTable(
        normal=2.0 * beta[:, 0] * np.sqrt(spring.normal),
        shear=2.0 * beta[:, 1] * np.sqrt(spring.shear),
        tension=np.array([table is not None and table.tension for table in found]),
    )


def weaker(a, b):
    """The smaller fractions of two tables; it may pull if both allow it."""
    return Dashpot(normal=min(a.normal, b.normal), shear=min(a.shear, b.shear), tension=a.tension and b.tension)


def viscous_force(coefficient, root_mass, velocity):
    """-c v of Eqs (2) [N]; coefficient: 2 beta sqrt(k), root_mass: sqrt(m) of Eq (1), velocity [m/s]."""
    return -coefficient * root_mass * velocity
