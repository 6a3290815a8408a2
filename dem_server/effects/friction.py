"""Coulomb friction at contacts that are not bonded.

    |Fs| <= mu Fn,    mu = min(mu_a, mu_b)                                       (1)

Source: Cundall & Strack (1979), Géotechnique 29, 47-65. Without this table an unbonded contact carries no
shear force.
"""

from typing import ClassVar, NamedTuple

import numpy as np

from coupler_protocol.scene.declare import Effect, quantity
from dem_server.effects.pairs import by_kind


class Friction(Effect):
    """Coulomb slip limit at contacts without a bond"""

    source: ClassVar[str] = "Cundall & Strack (1979), Géotechnique 29, 47-65"
    coefficient: float = quantity(meaning="friction coefficient; the smaller value of a pair counts", ge=0)


class FrictionTable(NamedTuple):
    """Friction coefficients of each kind of pair: `coefficient` (kinds,) [-]."""

    coefficient: np.ndarray


def friction_table(pairs):
    """Table of the kinds of pairs; a disc without a friction table is smooth. None if all discs are smooth."""
    found = by_kind(pairs, "friction", lambda a, b: min(a, b, key=lambda table: table.coefficient))
    if found is None:
        return None
    return FrictionTable(np.array([table.coefficient if table else 0.0 for table in found]))


def slip_limit(coefficient, normal):
    """Limit mu Fn of Eq (1) [N] for a compressive normal force [N]."""
    return coefficient * normal


def clipped(force, limit):
    """`force` limited to ±`limit` (both in N, limit >= 0)."""
    return min(max(force, -limit), limit)
