"""The discs' law: the effects at contacts and on discs, in acting order, with their parameters.

A material of the discs is a *grain*: an object with `density`, `spring` and a table for each of its effects (`friction`,
`bond`, `rolling`, `dashpot`, `parallel_bond`; missing or None: absent), such as the scene's `discs.soil`. Discs have the
number of their material, contacts have the number of their *kind of pair* `kind = a * materials + b`, and every effect
has one array over kinds. An absent effect is None: numba compiles it away, and its arrays are never made.
"""

from types import NoneType
from typing import NamedTuple, get_args, get_type_hints

from dem_server.effects.bond import BondTable, bond_table
from dem_server.effects.damping import DampingTable
from dem_server.effects.dashpot import DashpotTable, dashpot_table
from dem_server.effects.friction import FrictionTable, friction_table
from dem_server.effects.pairs import Pair
from dem_server.effects.parallel_bond import ParallelBondTable, parallel_bond_table
from dem_server.effects.rolling import RollingTable, rolling_table
from dem_server.effects.spring import SpringTable, spring_table

RING, SOIL, STONE = 0, 1, 2  # numbers of the materials
NAMES = ("ring", "soil", "stone")  # their names in `discs.pair`


class Law(NamedTuple):
    """Effects in acting order; None: absent."""

    spring: SpringTable
    friction: FrictionTable | None = None
    bond: BondTable | None = None
    rolling: RollingTable | None = None
    dashpot: DashpotTable | None = None
    parallel_bond: ParallelBondTable | None = None
    damping: DampingTable | None = None

    @property
    def has_shear(self):
        """Whether any contact can carry a shear force."""
        return any(effect is not None for effect in (self.friction, self.bond, self.dashpot, self.parallel_bond))


def _table_classes():
    """{name of an effect that acts at contacts: class of its table}, in acting order."""
    hints = {name: get_args(hint) or (hint,) for name, hint in get_type_hints(Law).items() if name != "damping"}
    return {name: next(cls for cls in classes if cls is not NoneType) for name, classes in hints.items()}


TABLES = _table_classes()


def grains_of(discs, ring=None):
    """Materials by number; `ring` None: a contact with the ring has the properties of the other disc."""
    return [ring, discs.soil] if discs.stone is None else [ring, discs.soil, discs.stone]


def pairs_of(grains, tables=()):
    """The Pair of every kind of pair, in the order of `kind`; a grain that is None has the properties of its partner.

    tables: the scene's `discs.pair`; each takes precedence over the combination of its two materials.
    """
    own = {frozenset(table.between): table for table in tables}
    some = next(g for g in grains if g is not None)
    return [
        Pair(a or b or some, b or a or some, own.get(frozenset((NAMES[i], NAMES[j]))))
        for i, a in enumerate(grains)
        for j, b in enumerate(grains)
    ]


def law_from(discs, ring=None):
    """Law of the scene's `discs` table (and its `ring` table, if there is one)."""
    pairs = pairs_of(grains_of(discs, ring), getattr(discs, "pair", ()))
    spring = spring_table(pairs, discs.stiffness)
    return Law(
        spring=spring,
        friction=friction_table(pairs),
        bond=bond_table(pairs),
        rolling=rolling_table(pairs),
        dashpot=dashpot_table(pairs, spring),
        parallel_bond=parallel_bond_table(pairs),
        damping=DampingTable(discs.damping.local) if discs.damping is not None else None,
    )
