"""Tables of a stage that change materials, discs and records from this stage on: those of the scene, with the keys that change.

The classes are made from those of the effects: every key has the unit, bounds and meaning of the effect's own, and none is
required. coupler_protocol.scene.changes applies them.
"""

from functools import cache
from typing import Any, ClassVar

from pydantic import Field, create_model, model_validator

from coupler_protocol.scene.declare import Effect, Table, quantity
from coupler_protocol.scene.names import Label
from coupler_protocol.scene.tables.materials import Substance


class Change(Table):
    """Keys of an effect that change; the others stay. `false` in place of the table: the effect ends."""

    effect: ClassVar[Any] = None  # the class of the effect
    absent: bool = quantity(False, meaning="true: the effect ends, as with `false` in place of the table")

    @model_validator(mode="before")
    @classmethod
    def _false_is_absent(cls, data: Any) -> Any:
        return {"absent": True} if data is False else data

    def given(self) -> dict[str, Any]:
        """The keys that change."""
        return self.model_dump(exclude_none=True, exclude={"absent"})


@cache
def change_of(effect: type[Effect]) -> type[Change]:
    """The Change of an effect: its keys, none of them required."""
    doc = f"Changes of: {_first_line(effect)}."
    made = create_model(effect.__name__, __base__=Change, __doc__=doc, **optional_fields(effect))
    made.effect = effect
    return made


def optional_fields(table: type[Table]) -> dict[str, Any]:
    """Fields with the units, bounds and meanings of a table's keys, None if they are not given."""
    fields: dict[str, Any] = {}
    for name, field in table.model_fields.items():
        kind: Any = field.annotation
        fields[name] = (kind | None, Field(None, description=field.description, json_schema_extra=field.json_schema_extra))
        fields[name][1].metadata.extend(field.metadata)  # the bounds
    return fields


def _first_line(effect: type) -> str:
    return (effect.__doc__ or "").strip().splitlines()[0]


class StageMaterial(Table):
    """Effects of a material of the grid that change from this stage on: the tables of `[[material]]` with the keys that change.

    A table that the material does not have begins with all its required keys; `false` in place of a table ends the effect.
    Stresses do not change with the material: they follow the new moduli from there on, and a lower strength reduces them in the
    first step. Density and place of a material never change.
    """

    name: Label = quantity(meaning="name of the material")


class StageGrain(Table):
    """Effects of a material of discs that change from this stage on, as in `[[stage.material]]`; not the density."""


class StageRing(Table):
    """Effects of contacts with control discs and walls that change from this stage on, as in `[[stage.material]]`.

    If the scene has no `[ring]`, it begins here: these contacts then have only the effects of this table, and no bonds.
    """


class StagePair(Table):
    """Effects of contacts between two materials of discs that change from this stage on, as in `[[stage.material]]`."""

    between: tuple[Substance, Substance] = quantity(meaning="the two materials")


class StageDiscs(Table):
    """Effects of discs that change from this stage on, once the discs are packed (with a grid: once they are coupled).

    Contacts keep their forces: normal forces by a gap at which the changed spring has no force (only contacts with walls keep
    their overlap, so that their force changes with the spring), shear forces up to the limits of the changed effects. If a
    material gets its first bonds, its closed contacts are bonded at the start of the stage. Bonds that exist get the changed
    strengths, and broken ones stay broken.
    """

    bond_gap: float | None = quantity(
        None,
        unit="m",
        meaning="bonds are made at the start of this stage, without force, at all contacts with a gap up to this (0: those that "
        "touch), also where bonds broke; none: only where materials get their first bonds, at contacts that touch",
        ge=0,
    )


class StageRecord(Table):
    """Intervals of records that change from this stage on."""

    every: int | None = quantity(None, unit="steps", meaning="steps between frames", ge=1)
    history: int | None = quantity(None, unit="steps", meaning="steps between points of the histories", ge=1)
    measure: int | None = quantity(None, unit="steps", meaning="steps between values of the regions in `[[measure]]`", ge=1)
