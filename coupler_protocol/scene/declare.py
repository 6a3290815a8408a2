"""Declaration of the keys that an effect reads from a scene: name, unit, bounds, meaning.

A table in the scene is an effect in the kernel. The class that reads the table is in the same file as the equation that it
switches on. The scene reader finds it through the entry-point group `colluvium.effects`; the names in this group are the places
of the tables (`material.mohr_coulomb`, `grain.bond`, `damping`, ...).
"""

from typing import Any, ClassVar, NamedTuple, get_args

from pydantic import BaseModel, ConfigDict, Field, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError


def refused(reason: str, remedy: str) -> PydanticCustomError:
    """The error that a validator raises: what is wrong, and what would be right (coupler_protocol.scene.reader prints both)."""
    return PydanticCustomError("refused", "{reason}", {"reason": reason, "remedy": remedy})


class Table(BaseModel):
    """A table of a scene: unknown keys are errors, numbers are finite numbers, values do not change after reading."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @field_validator("*", mode="before")
    @classmethod
    def _numbers_are_numbers(cls, value: Any, info: ValidationInfo) -> Any:
        """Refuse texts and truth values where numbers are declared, and others than truth values: conversions hide mistakes."""
        kinds = _leaves(cls.model_fields[info.field_name or ""].annotation)
        if kinds <= {bool, type(None)} and value is not None and not isinstance(value, bool):
            raise refused(f"{value!r} is not true or false", f"{info.field_name} = true, or leave the key out")
        if not kinds & {int, float}:
            return value
        for item in _items(value):
            if isinstance(item, bool) and bool not in kinds:
                raise refused(f"{str(item).lower()} is not a number", f"{info.field_name} = 1.0, or another number")
            if isinstance(item, str) and str not in kinds and _is_number(item):
                raise refused(
                    f"the text {item!r} is not a number", f"{info.field_name} = {item.strip()}, without quotation marks"
                )
            if isinstance(item, str) and str not in kinds and _is_number(item.replace(",", ".", 1)):
                what = f"the text {item!r} is not a number: decimals have a point, thousands no mark"
                raise refused(what, f"{info.field_name} = {item.strip().replace(',', '.', 1)}, without quotation marks")
        return value


def _leaves(annotation: Any) -> set[type]:
    """The types inside an annotation; a Literal has those of its values, a table its own."""
    parts = get_args(annotation)
    if not parts:
        return {annotation if isinstance(annotation, type) else type(annotation)}
    return set().union(*map(_leaves, parts))


def _items(value: Any) -> list[Any]:
    """The values in lists of lists, or the value."""
    return [item for part in value for item in _items(part)] if isinstance(value, list | tuple) else [value]


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


class Effect(Table):
    """A table that switches on an effect. The first line of its docstring describes the effect."""

    source: ClassVar[str] = ""

    @classmethod
    def after_change(cls, before: dict[str, Any], given: dict[str, Any]) -> dict[str, Any]:
        """Keys of the table after a stage has changed those `given`; a law whose keys replace each other says which ones."""
        return before | given


def quantity(
    default: Any = ...,
    *,
    unit: str = "-",
    meaning: str,
    usual: tuple[float, float] | None = None,
    remedy: str = "",
    place: str = "",
    **bounds: Any,
) -> Any:
    """Declares one key: its unit, its meaning and its bounds (pydantic's ge, gt, le, lt, min_length, ...).

    usual: smallest and largest value of soil and rock, beside 0; others are doubted (coupler_protocol.scene.rules.units).
    remedy: what to use instead of a value outside the bounds.
    place: the value is a place in the scene: "x" or "y" of coordinates along one axis, "xy" of points
    (coupler_protocol.scene.local_origin).
    """
    extra: dict[str, Any] = {"unit": unit} | ({"usual": list(usual)} if usual else {}) | ({"remedy": remedy} if remedy else {})
    extra |= {"place": place} if place else {}
    return Field(default, description=meaning, json_schema_extra=extra, **bounds)


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
