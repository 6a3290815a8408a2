"""Viscous dashpots parallel to the springs of a contact, given by the fraction of critical damping.

    cn = 2 beta_n sqrt(m kn),   cs = 2 beta_s sqrt(m ks),   m = mi mj / (mi + mj)     (1)
    Fn' = Fn - cn vn,           Fs' = Fs - cs vs                                      (2)

vn: rate of the gap, vs: rate of slip; m of a disc in a clump is the clump's mass, that of a held disc is
infinite. With `tension = false` Fn' must not pull: Fn' >= 0. In slip |Fs'| <= mu Fn. Limits of friction and
bonds, and recorded forces, are for the spring forces. In static mode masses and velocities are those of the
scaled motion.

Two discs that collide separate with e times their speed; with s = sqrt(|1 - beta^2|)

    tension:            e = exp(-pi beta / s)                                     (3)
    none, beta < 1:     e = exp(-beta / s (pi - atan2(2 beta s, 1 - 2 beta^2)))   (4)
    none, beta > 1:     e = exp(-beta / s ln((beta + s) / (beta - s)))            (5)

and e = exp(-2) without tension at beta = 1. A table with the restitution e gets the beta for which these equations give e. For
two materials the smaller fraction counts, so the larger restitution: the damping that both have. Fractions are compared for the
`tension` of the pair, so a pair of equal restitutions has this restitution.
Sources: Schwager & Poeschel (2007), Granular Matter 9, 465-469 (both e); Itasca, PFC2D 3.1 Theory, "Mechanical
damping".
"""

from math import atan2, exp, log, pi, sqrt
from typing import ClassVar, NamedTuple

import numpy as np
from pydantic import model_validator

from coupler_protocol.scene.declare import Effect, History, quantity
from dem_server.effects.pairs import by_kind


class Dashpot(Effect):
    """viscous dashpots at the contacts"""

    source: ClassVar[str] = "Schwager & Poeschel (2007), Granular Matter 9, 465-469"
    normal: float | None = quantity(
        None, meaning="fraction of critical damping in the gap; the smaller value of a pair counts", ge=0, le=10
    )
    restitution: float | None = quantity(
        None,
        meaning="instead of `normal`: speed after over speed before a head-on collision of two discs; the larger value of a "
        "pair counts",
        ge=0.01,
        le=1,
    )
    shear: float = quantity(0.0, meaning="fraction of critical damping in slip; the smaller value of a pair counts", ge=0, le=10)
    tension: bool = quantity(False, meaning="the normal dashpot may pull at an unbonded contact")

    @model_validator(mode="after")
    def _one_of_two(self):
        if (self.normal is None) == (self.restitution is None):
            raise ValueError("a dashpot has either `normal` or `restitution`: give one of the two")
        return self

    @classmethod
    def after_change(cls, before, given):
        """Keys of the table after a change: `normal` and `restitution` replace each other."""
        other = {"normal": "restitution", "restitution": "normal"}
        return {key: value for key, value in before.items() if other.get(key) not in given} | given

    def fraction(self, tension):
        """beta_n of Eqs (1) [-]; tension: whether the dashpot of the contact may pull."""
        return self.normal if self.restitution is None else fraction_of(self.restitution, tension)


HISTORIES = (History("root_mass", "pair", unit="kg^0.5", meaning="sqrt(m) of Eqs (1), set with the masses of the discs"),)


class DashpotTable(NamedTuple):
    """Of each kind of pair: `normal`, `shear` (kinds,): 2 beta sqrt(k) [sqrt(N/m)]; `tension` (kinds,): may pull."""

    normal: np.ndarray
    shear: np.ndarray
    tension: np.ndarray


def dashpot_table(pairs, spring):
    """Table of the kinds of pairs with the stiffnesses `spring`; a contact has dashpots if both discs have them."""
    found = by_kind(pairs, "dashpot", weaker)
    if found is None:
        return None
    beta = np.array([(table.fraction(table.tension), table.shear) if table else (0.0, 0.0) for table in found])
    return DashpotTable(
        normal=2.0 * beta[:, 0] * np.sqrt(spring.normal),
        shear=2.0 * beta[:, 1] * np.sqrt(spring.shear),
        tension=np.array([table is not None and table.tension for table in found]),
    )


def weaker(a, b):
    """Table with the smaller fractions of two tables; it may pull if both may."""
    tension = a.tension and b.tension
    return Dashpot(normal=min(a.fraction(tension), b.fraction(tension)), shear=min(a.shear, b.shear), tension=tension)


def restitution_of(beta, tension):
    """e of two discs that collide head-on, Eqs (3) to (5) [-]."""
    s = sqrt(abs(1.0 - beta * beta))
    if tension:
        return exp(-pi * beta / s) if beta < 1.0 else 0.0
    if s == 0.0:
        return exp(-2.0)
    if beta < 1.0:
        return exp(-beta / s * (pi - atan2(2.0 * beta * s, 1.0 - 2.0 * beta * beta)))
    return exp(-beta / s * log((beta + s) / (beta - s)))


def fraction_of(restitution, tension):
    """beta for which Eqs (3) to (5) give the restitution; Eq (3) in closed form, the others by halving an interval."""
    if tension:
        decrement = -log(restitution)
        return decrement / sqrt(pi * pi + decrement * decrement)
    low, high = 0.0, 10.0  # e of 10 is 0.0024
    while True:
        middle = 0.5 * (low + high)
        if middle in (low, high):
            return low
        low, high = (middle, high) if restitution_of(middle, tension) > restitution else (low, middle)


def viscous_force(coefficient, root_mass, velocity):
    """-c v of Eqs (2) [N]; coefficient: 2 beta sqrt(k), root_mass: sqrt(m) of Eq (1), velocity [m/s]."""
    return -coefficient * root_mass * velocity
