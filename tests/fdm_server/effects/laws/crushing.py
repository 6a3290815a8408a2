"""A law file as another distribution would bring it: grains crush where the mean pressure reaches a limit, volume is lost.

    p = -(2 sm + zz)/3 <= pc

A trial stress beyond is brought back along the hydrostatic axis; the deviator stays. In uniaxial compression by the strain e
the mean pressure is K e up to pc, then pc, and the stress difference xx - yy goes on to grow elastically.
"""

from typing import ClassVar, NamedTuple

from coupler_protocol.scene.declare import Effect, quantity


class Crushing(Effect):
    """Crushing of grains under mean pressure"""

    source: ClassVar[str] = "a vertical cap, e.g. Puzrin (2012), Constitutive Modelling in Geomechanics"
    pressure: float = quantity(unit="Pa", meaning="mean pressure pc at which grains crush", gt=0)


class Parameters(NamedTuple):
    """What the law reads in a zone."""

    pressure: float  # pc [Pa]


def parameters(table, elastic):
    """Parameters of one material; no table: grains never crush."""
    return Parameters(float("inf") if table is None else table.pressure)


def corrected(sm, zz, sd, xy, p):
    """Stresses [Pa] of a triangle after the law."""
    beyond = -(2.0 * sm + zz) / 3.0 - p.pressure
    if beyond <= 0.0:
        return sm, zz, sd, xy
    return sm + beyond, zz + beyond, sd, xy
