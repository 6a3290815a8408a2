"""Parallel bond: a disc of cement between two discs that carries force and bending, parallel to the contact's springs.

With R = radius * min(ri, rj), cross-section A = 2 R and second moment J = 2 R^3 / 3 (unit thickness), stiffnesses
per area kn', ks', and g0 the gap when the bond was made, without stress:

    Fn = -kn' A (g - g0),   Fs <- Fs - ks' A slip,   M <- M - kn' J (wj - wi) dt       (1)
    sigma = -Fn / A + |M| R / J > tension:  broken in tension                          (2)
    tau   = |Fs| / A > shear:               broken in shear                            (3)

Fn is compression positive; Fs and M act on disc j. A broken bond has no force and does not heal; the springs of the
contact remain. A row of discs with bonds of radius 1 bends like a beam of depth 2 R with E = kn' 2 R.
Source: Potyondy & Cundall (2004), Int. J. Rock Mech. Min. Sci. 41, 1329-1364, Eqs (9)-(16).
"""

from typing import ClassVar, NamedTuple

import numpy as np

from coupler_protocol.scene.declare import Effect, History, quantity
from dem_server.effects.bond import BONDED, BROKEN_SHEAR, BROKEN_TENSION
from dem_server.effects.pairs import by_kind


class ParallelBond(Effect):
    """parallel bonds that carry force and moment and break by stress"""

    source: ClassVar[str] = "Potyondy & Cundall (2004), Int. J. Rock Mech. Min. Sci. 41, 1329-1364"
    normal_stiffness: float = quantity(unit="Pa/m", meaning="normal stiffness over area; of two materials in series", gt=0)
    shear_stiffness: float = quantity(unit="Pa/m", meaning="shear stiffness over area; of two materials in series", ge=0)
    tension: float = quantity(unit="Pa", meaning="tensile strength; the smaller value of a pair counts", ge=0)
    shear: float = quantity(unit="Pa", meaning="shear strength; the smaller value of a pair counts", ge=0)
    radius: float = quantity(
        1.0, meaning="radius of the bond over that of the smaller disc; the smaller value of a pair counts", gt=0, le=2
    )


class ParallelBondTable(NamedTuple):
    """Of each kind of pair (kinds,): stiffnesses `normal`, `shear` [Pa/m], strengths `tension`, `cohesion` [Pa], `radius` [-].

    Radius zero: never bonded.
    """

    normal: np.ndarray
    shear: np.ndarray
    tension: np.ndarray
    cohesion: np.ndarray
    radius: np.ndarray


HISTORIES = (
    History("parallel.state", "pair", "i1", meaning="as of contact bonds", recorded="parallel_bond_state"),
    History("parallel.reported", "pair", "i1", meaning="1: the list of cracks has the break of this bond"),
    History("parallel.gap", "pair", unit="m", meaning="g0 of Eqs (1)"),
    History("parallel.normal", "pair", unit="N", meaning="Fn of Eqs (1)", recorded="parallel_bond_normal_force"),
    History("parallel.shear", "pair", unit="N", meaning="Fs of Eqs (1)", recorded="parallel_bond_shear_force"),
    History("parallel.moment", "pair", unit="N m", meaning="M of Eqs (1)", recorded="parallel_bond_moment"),
)


def parallel_bond_table(pairs):
    """Table of the kinds of pairs; a contact has a parallel bond if both discs have the table. None if no kind has one."""
    found = by_kind(pairs, "parallel_bond", weaker)
    if found is None:
        return None
    rows = [
        (t.normal_stiffness, t.shear_stiffness, t.tension, t.shear, t.radius) if t else (0.0,) * 5
        for t in found
    ]  # fmt: skip
    return ParallelBondTable(*np.array(rows).T.copy())


def weaker(a, b):
    """Table with the stiffnesses of two halves in series, unchanged for equal ones, and the smaller strengths and radius."""
    return ParallelBond(
        normal_stiffness=halves(a.normal_stiffness, b.normal_stiffness),
        shear_stiffness=halves(a.shear_stiffness, b.shear_stiffness),
        tension=min(a.tension, b.tension),
        shear=min(a.shear, b.shear),
        radius=min(a.radius, b.radius),
    )


def halves(a, b):
    """Harmonic mean; zero if one of the two is zero."""
    return 2.0 * a * b / (a + b) if a * b > 0.0 else 0.0


def bond_radius(factor, smaller):
    """Radius R of the bond [m]; smaller: radius of the smaller disc [m]."""
    return factor * smaller


def bending_stiffness(normal_stiffness, radius):
    """kn' J of Eqs (1) [N m]; radius: R [m]."""
    return normal_stiffness * 2.0 / 3.0 * radius**3


def parallel_bond_after(normal, shear, moment, radius, tensile_strength, shear_strength):
    """State of a bond under forces [N] and moment [N m]: Eq (2), then Eq (3)."""
    if -normal / (2.0 * radius) + 1.5 * abs(moment) / radius**2 > tensile_strength:
        return BROKEN_TENSION
    if abs(shear) / (2.0 * radius) > shear_strength:
        return BROKEN_SHEAR
    return BONDED
