"""How an effect declares the keys it reads from a scene: name, unit, bounds, meaning.

A table in the scene is an effect in the kernel. The class that reads the table stands in the same file as the equation it
switches on; the scene reader finds it through the entry-point group `colluvium.effects`, whose names say where the table
belongs (`material.mohr_coulomb`, `grain.bond`, `damping`, ...).
"""

from typing import Any, ClassVar, NamedTuple

from pydantic import BaseModel, ConfigDict, Field


class Table(BaseModel):
    """A table of a scene: unknown keys are errors, numbers are finite, values do not change after reading."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Effect(Table):
    """A table that switches on an effect. The docstring's first line says what the effect is."""

    source: ClassVar[str] = ""


def quantity(default: Any = ..., *, unit: str = "-", meaning: str, **bounds: Any) -> Any:
    """Declare one key: its unit, what it means and its bounds (pydantic's ge, gt, le, lt, min_length, ...)."""
    return Field(default, description=meaning, json_schema_extra={"unit": unit}, **bounds)


class History(NamedTuple):
    """An array in which a law remembers something: its name in State, `components` numbers per `place`, what it means.

    place: "pair", "zone" or "gridpoint"; what carries arrays of that place (a new contact list, a removed zone, a checkpoint, a
    frame) carries this one by its declaration. recorded: its name in frames; "": in none. of_stage: starts at zero in each stage.
    """

    name: str
    place: str
    dtype: str = "f8"
    unit: str = "-"
    meaning: str = ""
    components: int = 1
    recorded: str = ""
    of_stage: bool = False


def increasing(value):
    """A pair whose first number is not larger than the second; for AfterValidator."""
    if value[0] > value[1]:
        raise ValueError("the first number must not be larger than the second")
    return value
