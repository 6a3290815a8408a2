"""Keys of materials besides their effects: soils of the continuum, materials of discs, and contacts between them.

Tables of effects (elastic, friction, bond, ...) are added to these classes from the entry points (coupler_protocol.scene.scene).
"""

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import AfterValidator

from coupler_protocol.scene.declare import Table, quantity
from coupler_protocol.scene.names import Label
from coupler_protocol.scene.tables.grid import Point

DENSITIES = (300.0, 10e3)  # [kg/m3] of what slopes and laboratory tests are made of: from pumice to steel
Substance = Literal["soil", "stone", "ring"]


def _rightwards(line: list[tuple[float, float]]) -> list[tuple[float, float]]:
    if any(b[0] <= a[0] for a, b in pairwise(line)):
        raise ValueError("points must follow each other from left to right")
    return line


class Material(Table):
    """A soil of the continuum; a zone has the last material whose region (or ground below `top`) contains its centre."""

    name: Label = quantity(meaning="name of the material")
    density: float = quantity(unit="kg/m3", meaning="density", usual=DENSITIES, gt=0)
    region: list[Point] | None = quantity(
        None, unit="m", place="xy", meaning="polygon of the material; none: everywhere", min_length=3
    )
    top: Annotated[list[Point], AfterValidator(_rightwards)] | None = quantity(
        None,
        unit="m",
        place="xy",
        meaning="line from left to right below which the material fills the ground (level beyond its ends), instead of a region; "
        'with fit = "profile" zones follow the line where their shape permits, elsewhere their centre decides',
        min_length=1,
    )


class Grain(Table):
    """Material of discs."""

    density: float = quantity(unit="kg/m3", meaning="density of the discs", usual=DENSITIES, gt=0)


class Ring(Table):
    """Properties of contacts with control discs."""


class Pair(Table):
    """Contacts between two materials of discs; a table here replaces the combination of both materials."""

    between: tuple[Substance, Substance] = quantity(meaning="the two materials")
