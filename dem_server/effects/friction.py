"""Coulomb friction at contacts that are not bonded.

    |Fs| <= mu Fn,    mu = min(mu_a, mu_b)                                       (1)

Source: Cundall & Strack (1979), Géotechnique 29, 47-65. Without this table an unbonded contact carries no
shear force.
"""

from typing import ClassVar, NamedTuple

import numpy as np

from coupler_protocol.scene.declare import Effect, quantity
from dem_server.effects.pairs import smaller_of_kind


class Friction(Effect):
    """Coulomb slip limit at contacts without a bond"""

    source: ClassVar[str] = "Cundall & Strack (1979), Géotechnique 29, 47-65"
    coefficient: float = quantity(meaning="friction coefficient; the smaller value of a pair counts", ge=0)


class FrictionTable(NamedTuple):
    """Friction coefficients of each kind of pair: `coefficient` (kinds,) [-]."""

    coefficient: np.ndarray


def friction_table(pairs):
    """Table of the kinds of pairs; a disc without a friction table is smooth. None if all are."""
    coefficient = smaller_of_kind(pairs, "friction", "coefficient")
    return None if coefficient is None else FrictionTable(coefficient)


def slip_limit(coefficient, normal):
    """Limit mu Fn of Eq (1) [N] for a compressive normal force [N]."""
    return coefficient * normal


def clipped(force, limit):
    """`force` limited to ±`limit` (both in N, limit >= 0)."""
    return min(max(force, -limit), limit)
