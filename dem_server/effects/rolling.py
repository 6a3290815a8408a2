"""Rolling resistance: a spring against the relative turn of two touching discs, with a limit like Coulomb's.

    Mr <- Mr - kr (wj - wi) dt,    kr = ks Rb^2,    Rb = ri rj / (ri + rj)       (1)
    |Mr| <= mur Rb max(Fn, 0)                                                    (2)

Mr acts on disc j, -Mr on disc i. A disc rolls down a plane only if the plane is steeper than mur (as a slope).
The max is for bonds in tension: a negative limit would reverse the moment in every step.
Sources: Iwashita & Oda (1998), J. Eng. Mech. 124, 285-292; Ai, Chen, Rotter & Ooi (2011), Powder Technol. 206,
269-282 (the elastic-plastic spring without viscosity); kr as in Itasca, PFC, "Rolling resistance linear model".
"""

from typing import ClassVar, NamedTuple

import numpy as np

from coupler_protocol.scene.declare import Effect, History, quantity
from dem_server.effects.pairs import smaller_of_kind


class Rolling(Effect):
    """rolling resistance at contacts"""

    source: ClassVar[str] = "Iwashita & Oda (1998), J. Eng. Mech. 124, 285-292"
    coefficient: float = quantity(meaning="rolling coefficient; the smaller value of a pair counts", ge=0)


HISTORIES = (History("rolled", "pair", unit="N m", meaning="Mr of Eq (1)", recorded="rolling_moment"),)


class RollingTable(NamedTuple):
    """Rolling coefficients of each kind of pair: `coefficient` (kinds,) [-]."""

    coefficient: np.ndarray


def rolling_table(pairs):
    """Table of the kinds of pairs; a disc without a rolling table rolls freely. None if all do."""
    coefficient = smaller_of_kind(pairs, "rolling", "coefficient")
    return None if coefficient is None else RollingTable(coefficient)


def effective_radius(ri, rj):
    """Rb of Eq (1) [m]."""
    return ri * rj / (ri + rj)


def rolling_stiffness(ks, radius):
    """kr of Eq (1) [N m]; radius: Rb [m]."""
    return ks * radius * radius


def rolling_moment(kr, turn, before):
    """Mr of Eq (1) [N m]; turn: (wj - wi) dt of this step, before: moment so far [N m]."""
    return before - kr * turn


def rolling_limit(coefficient, radius, normal):
    """Limit mur Rb max(Fn, 0) of Eq (2) [N m]; radius: Rb [m], normal: Fn [N]."""
    return coefficient * radius * max(normal, 0.0)
