"""The discs' law: which effects act at a contact and on a disc, in acting order, with their parameters.

A material of the discs is a *grain*: an object with `density`, `spring`, `friction`, `bond` (the last two
may be None), such as the scene's `discs.soil`. Discs carry the number of their material, contacts the
number of their *kind of pair* `kind = a * materials + b`, and every effect keeps one array over kinds. None
stands for an effect that is absent: numba compiles it away, and its arrays are never made.
"""

from typing import NamedTuple

from dem_server.effects.bond import BondTable, bond_table
from dem_server.effects.damping import DampingTable
from dem_server.effects.friction import FrictionTable, friction_table
from dem_server.effects.spring import SpringTable, spring_table

RING, SOIL, STONE = 0, 1, 2  # numbers of the materials


class Law(NamedTuple):
    """Effects in acting order; None: absent."""

    spring: SpringTable
    friction: FrictionTable | None
    bond: BondTable | None
    damping: DampingTable | None

    @property
    def has_shear(self):
        """Whether any contact can carry a shear force."""
        return self.friction is not None or self.bond is not None


def grains_of(discs, ring=None):
    """Materials by number; `ring` None: the ring takes the properties of whichever disc touches it."""
    return [ring, discs.soil] if discs.stone is None else [ring, discs.soil, discs.stone]


def pairs_of(grains):
    """The two grains of every kind of pair, in the order of `kind`; None takes after its partner."""
    some = next(g for g in grains if g is not None)
    return [(a or b or some, b or a or some) for a in grains for b in grains]


def law_from(discs, ring=None):
    """Law of the scene's `discs` table (and its `ring` table, if there is one)."""
    pairs = pairs_of(grains_of(discs, ring))
    return Law(
        spring=spring_table(pairs, discs.stiffness),
        friction=friction_table(pairs),
        bond=bond_table(pairs),
        damping=DampingTable(discs.damping.local) if discs.damping is not None else None,
    )
