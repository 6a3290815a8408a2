"""Declaration of the keys that an effect reads from a scene: name, unit, bounds, meaning.

A table in the scene is an effect in the kernel. The class that reads the table is in the same file as the equation that it
switches on. The scene reader finds it through the entry-point group `colluvium.effects`; the names in this group are the places
of the tables (`material.mohr_coulomb`, `grain.bond`, `damping`, ...).
"""

from typing import Any, ClassVar, NamedTuple

from pydantic import BaseModel, ConfigDict, Field


class Table(BaseModel):
    """A table of a scene: unknown keys are errors, numbers are finite, values do not change after reading."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Effect(Table):
    """A table that switches on an effect. The first line of its docstring describes the effect."""

    source: ClassVar[str] = ""


def quantity(default: Any = ..., *, unit: str = "-", meaning: str, **bounds: Any) -> Any:
    """Declares one key: its unit, its meaning and its bounds (pydantic's ge, gt, le, lt, min_length, ...)."""
    return Field(default, description=meaning, json_schema_extra={"unit": unit}, **bounds)


class History(NamedTuple):
    """A history array of a law: its name in State, `components` numbers for each `place`, its meaning.

    place: "pair", "zone" or "gridpoint". All that handles arrays of this place (a new contact list, a removed zone, a checkpoint,
    a frame) handles this array by its declaration. recorded: its name in frames; "": in none. of_stage: zero at the start of
    every stage.
    """

    name: str
    place: str
    dtype: str = "f8"
    unit: str = "-"
    meaning: str = ""
    components: int = 1
    recorded: str = ""
    of_stage: bool = False


def increasing(value: tuple[Any, Any]) -> tuple[Any, Any]:
    """Returns a pair of numbers; raises ValueError if the first is larger than the second. For AfterValidator."""
    if value[0] > value[1]:
        raise ValueError("the first number must not be larger than the second")
    return value
