"""Pairs of materials at a contact, and their tables in the scene.

Every effect has a rule that combines the tables of two grains. A table of `discs.pair` for the two takes precedence:
its values are those of the contact.
"""

from typing import Any, NamedTuple

import numpy as np


class Pair(NamedTuple):
    """Grains `a` and `b` of a contact, and `own`: their table of `discs.pair`, or None."""

    a: Any
    b: Any
    own: Any = None

    def tables(self, effect):
        """Tables (of a, of b, of the pair) of the effect with this name; None for a missing table."""
        return tuple(getattr(owner, effect, None) for owner in self)


def by_kind(pairs, effect, combine):
    """Table of each kind of pair: the table of the pair, or `combine(a, b)` of the tables of both grains, or None.

    Returns None instead of a list if no kind of pair has a table.
    """
    found = []
    for pair in pairs:
        a, b, own = pair.tables(effect)
        found.append(own if own is not None else combine(a, b) if a is not None and b is not None else None)
    return found if any(table is not None for table in found) else None


def smaller_of_kind(pairs, effect, key):
    """The number `key` of an effect for each kind of pair (kinds,): the pair's own, or the smaller of both grains.

    Zero where one of the two grains lacks the effect. Returns None instead of an array if no kind of pair has it.
    """
    found = by_kind(pairs, effect, lambda a, b: min(a, b, key=lambda table: getattr(table, key)))
    return None if found is None else np.array([getattr(table, key) if table else 0.0 for table in found])
