"""The [[stage]] tables of a scene: the procedure, the changes of each stage, and its end."""

from collections.abc import Iterable
from numbers import Real
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from coupler_protocol.scene import stage_kinds
from coupler_protocol.scene.declare import Table, increasing, quantity
from coupler_protocol.scene.names import Name
from coupler_protocol.scene.tables.boundary import Boundary, waits_for_rest
from coupler_protocol.scene.tables.changes import StageRecord
from coupler_protocol.scene.tables.discs import StageWall
from coupler_protocol.scene.tables.grid import Point, Span

STOPPED = "stopped"  # stands for a stage in the name of the State that is saved where a run fails


def _constant(value: Any) -> Any:
    return {"to": value} if isinstance(value, Real) and not isinstance(value, bool) else value


class Ramp(Table):
    """A value that changes linearly over some steps."""

    to: float = quantity(meaning="value at the end", ge=0)
    over: int = quantity(0, unit="steps", meaning="steps of the ramp", ge=0)


class Until(Table):
    """Conditions that end a stage: the first one fulfilled ends it."""

    ratio: float | None = quantity(None, meaning="unbalanced force ratio of every code, sustained", gt=0, lt=1)
    steps: int | None = quantity(None, unit="steps", meaning="steps of the stage", ge=1)
    time: float | None = quantity(None, unit="s", meaning="seconds of the stage, in real time", gt=0)
    displacement: float | None = quantity(None, unit="m", meaning="largest displacement of a gridpoint", gt=0)
    band: Literal["enters", "through", "complete"] | None = quantity(
        None, meaning="first frame in which the band enters a window, is through it, or connects toe and crest (docs/theory.md)"
    )


class Excavation(Table):
    """Zones to excavate, given by columns and rows or by a polygon around their centres."""

    columns: Annotated[Span, AfterValidator(increasing)] | None = quantity(None, meaning="first and last zone in x, from 0")
    rows: Annotated[Span, AfterValidator(increasing)] | None = quantity(None, meaning="first and last zone in y, from 0")
    polygon: list[Point] | None = quantity(None, unit="m", place="xy", meaning="outline of the excavation", min_length=3)
    over: int | None = quantity(
        None,
        unit="steps",
        meaning="steps over which the forces of the removed zones are reduced to zero (none: 500 where the relief waits for "
        "rest, else 1)",
        ge=1,
    )
    ratio: float | None = waits_for_rest()

    @model_validator(mode="after")
    def _one_way(self) -> "Excavation":
        if (self.columns is None) != (self.rows is None) or (self.columns is None) == (self.polygon is None):
            raise ValueError("give columns and rows, or a polygon")
        return self


class Surcharge(Table):
    """Pressure on the ground surface, added to existing loads; its direction is constant."""

    x: Annotated[Point, AfterValidator(increasing)] = quantity(unit="m", place="x", meaning="first and last point")
    pressure: float = quantity(unit="Pa", meaning="pressure, normal to the surface", gt=0)
    over: int | None = quantity(
        None, unit="steps", meaning="steps of the ramp (none: 500 where the load waits for rest, else 1)", ge=1
    )
    ratio: float | None = waits_for_rest()


def is_real(time: str) -> bool:
    """Whether this value of `time` means real masses and seconds; else scaled masses (static mode)."""
    return time == "real"


def time_axis(stages: Iterable[tuple[str, str]]) -> str:
    """Axis of the frames of stages (kind, time): "time" [s] if all that compute are in real time, otherwise "step"."""
    modes = [is_real(time) for kind, time in stages if kind in stage_kinds.named(computes=True)]
    return "time" if modes and all(modes) else "step"


class Stage(Table):
    """One step of the procedure."""

    name: Name = quantity(meaning="name of the stage, and of its files; also its kind if no kind is given")
    # mypy cannot read names that are computed; pydantic does when the class is made
    kind: Literal[stage_kinds.NAMES] = quantity(  # type: ignore[valid-type]
        meaning="; ".join(f"{kind.name}: {kind.meaning}" for kind in stage_kinds.KINDS)
    )
    gravity: float | None = quantity(
        None, unit="m/s2", meaning="gravity, downwards; stays for later stages", remedy="it acts downwards", ge=0
    )
    gravity_factor: Annotated[Ramp, BeforeValidator(_constant)] | None = quantity(
        None, meaning="gravity is multiplied by this, a number or { to, over }; stays for later stages"
    )
    until: Until | None = quantity(None, meaning="when the stage ends")
    handover: int | None = quantity(
        None, unit="steps", meaning="kind couple: steps of the hand-over from zones to discs (500)", ge=1
    )
    insitu: bool | None = quantity(None, meaning="kind fill: bring the discs to the stress of the zones (true)")
    excavate: Excavation | None = quantity(None, meaning="kind excavate: the zones to remove")
    surcharge: Surcharge | None = quantity(None, meaning="kind surcharge: the pressure on the ground")
    boundary: list[Boundary] = Field(default_factory=list, description="sides that are fixed, moved or loaded from this stage on")
    wall: list[StageWall] = Field(default_factory=list, description="walls that move differently from this stage on")
    record: StageRecord | None = quantity(None, meaning="intervals of records that change from this stage on")
    large_strain: Literal[True] | None = quantity(None, meaning="zones follow their gridpoints from this stage on")
    time: Literal["static", "real"] = quantity(
        "static", meaning="scaled masses, for the path to rest; or real masses and seconds"
    )
    step_factor: float | None = quantity(
        None, meaning="time = real: share of the stable step (grid 0.5, discs their time_step; coupled: the shorter)", gt=0, le=1
    )
    discard: bool = quantity(False, meaning="discard the result: the next stage starts from the State in which this one started")

    @property
    def in_real_time(self) -> bool:
        """Whether the stage computes with real masses and seconds; else with scaled masses (static mode)."""
        return is_real(self.time)

    @model_validator(mode="before")
    @classmethod
    def _kind_from_name(cls, data: Any) -> Any:
        if isinstance(data, dict) and "kind" not in data and "name" in data:
            return {**data, "kind": data["name"]}
        return data
