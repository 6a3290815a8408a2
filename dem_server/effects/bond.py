"""Contact bond: glue of vanishing size that carries tension and shear until one of its strengths is exceeded.

    holds:   no slip limit, Fn may be tensile
    -Fn  > Fnb:   broken in tension, both forces drop to zero                    (1)
    |Fs| > Fsb:   broken in shear, |Fs| <= mu Fn from now on                     (2)

with Fnb, Fsb the smaller strengths of the two discs. A broken bond does not heal.
Source: Potyondy & Cundall (2004), Int. J. Rock Mech. Min. Sci. 41, 1329-1364; Itasca, PFC2D 3.1 Theory,
"Contact-bond model".
"""

from typing import ClassVar, NamedTuple

import numpy as np

from coupler_protocol.scene.declare import Effect, History, quantity
from dem_server.effects.pairs import by_kind

NONE, BONDED, BROKEN_TENSION, BROKEN_SHEAR = 0, 1, 2, 3  # values of `bond_state`


class Bond(Effect):
    """contact bonds that break in tension or shear"""

    source: ClassVar[str] = "Potyondy & Cundall (2004), Int. J. Rock Mech. Min. Sci. 41, 1329-1364"
    tension: float = quantity(unit="N", meaning="tensile strength of a contact bond", ge=0)
    shear: float = quantity(unit="N", meaning="shear strength of a contact bond", ge=0)


HISTORIES = (
    History("bond_state", "pair", "i1", meaning="NONE, BONDED, BROKEN_TENSION, BROKEN_SHEAR", recorded="bond_state"),
    History("bond_reported", "pair", "i1", meaning="1: the list of cracks has the break of this bond"),
)


class BondTable(NamedTuple):
    """Bond strengths of each kind of pair: `tension`, `shear` (kinds,) [N]; shear zero: never bonded."""

    tension: np.ndarray
    shear: np.ndarray


def bond_table(pairs):
    """Table of the kinds of pairs; a disc without a bond table has no bonds. None if no kind has bonds."""
    found = by_kind(pairs, "bond", weaker)
    if found is None:
        return None
    return BondTable(
        tension=np.array([table.tension if table else 0.0 for table in found]),
        shear=np.array([table.shear if table else 0.0 for table in found]),
    )


def weaker(a, b):
    """The smaller strengths of two tables."""
    return Bond(tension=min(a.tension, b.tension), shear=min(a.shear, b.shear))


def bond_after(normal, shear, tensile_strength, shear_strength):
    """State of a bond under `normal` (compression positive) and `shear` force [N]: Eq (1), then Eq (2)."""
    if -normal > tensile_strength:
        return BROKEN_TENSION
    if abs(shear) > shear_strength:
        return BROKEN_SHEAR
    return BONDED
