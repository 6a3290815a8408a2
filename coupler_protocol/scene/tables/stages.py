"""The [[stage]] tables of a scene: the procedure, what each step of it changes, and when it ends."""

from typing import Annotated, Literal

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from coupler_protocol.scene import stage_kinds
from coupler_protocol.scene.declare import Table, increasing, quantity
from coupler_protocol.scene.tables.boundary import Boundary
from coupler_protocol.scene.tables.discs import StageWall
from coupler_protocol.scene.tables.grid import Point, Span


def _constant(value):
    return {"to": value} if isinstance(value, int | float) and not isinstance(value, bool) else value


class Ramp(Table):
    """A value that changes linearly over some steps."""

    to: float = quantity(meaning="value at the end", ge=0)
    over: int = quantity(0, unit="steps", meaning="steps it takes to get there", ge=0)


class Until(Table):
    """When a stage ends: at whichever comes first."""

    ratio: float | None = quantity(None, meaning="unbalanced force ratio on every code, sustained", gt=0, lt=1)
    steps: int | None = quantity(None, unit="steps", meaning="steps of the stage", ge=1)
    time: float | None = quantity(None, unit="s", meaning="seconds of the stage, where it computes in real time", gt=0)
    displacement: float | None = quantity(None, unit="m", meaning="largest displacement of a gridpoint", gt=0)
    band: Literal["enters", "through", "complete"] | None = quantity(
        None, meaning="first frame in which the band enters a window, is through it, or connects toe and crest (docs/theory.md)"
    )


class Excavation(Table):
    """Zones that are dug away, by columns and rows or by a polygon around their centres."""

    columns: Annotated[Span, AfterValidator(increasing)] | None = quantity(None, meaning="first and last zone in x, from 0")
    rows: Annotated[Span, AfterValidator(increasing)] | None = quantity(None, meaning="first and last zone in y, from 0")
    polygon: list[Point] | None = quantity(None, unit="m", meaning="outline of what is dug away", min_length=3)
    over: int = quantity(1, unit="steps", meaning="steps over which the ground is relieved of what the zones carried", ge=1)

    @model_validator(mode="after")
    def _one_way(self):
        if (self.columns is None) != (self.rows is None) or (self.columns is None) == (self.polygon is None):
            raise ValueError("give columns and rows, or a polygon")
        return self


class Surcharge(Table):
    """Pressure upon the ground surface, added to what is there; its direction stays."""

    x: Annotated[Point, AfterValidator(increasing)] = quantity(unit="m", meaning="where it begins and ends")
    pressure: float = quantity(unit="Pa", meaning="pressure, normal to the surface", gt=0)
    over: int = quantity(1, unit="steps", meaning="steps over which it grows", ge=1)


class Stage(Table):
    """One step of the procedure."""

    name: str = quantity(meaning="name of the stage; also its kind where no kind is given", min_length=1)
    kind: Literal[stage_kinds.NAMES] = quantity(meaning="; ".join(f"{kind.name}: {kind.meaning}" for kind in stage_kinds.KINDS))
    gravity: float | None = quantity(None, unit="m/s2", meaning="gravity, downwards; stays for later stages", ge=0)
    gravity_factor: Annotated[Ramp, BeforeValidator(_constant)] | None = quantity(
        None, meaning="gravity is multiplied by this, a number or { to, over }; stays for later stages"
    )
    until: Until | None = quantity(None, meaning="when the stage ends")
    handover: int | None = quantity(
        None, unit="steps", meaning="kind couple: steps over which discs take over from zones (500)", ge=1
    )
    insitu: bool | None = quantity(None, meaning="kind fill: bring the discs to the zones' stress (true)")
    excavate: Excavation | None = quantity(None, meaning="kind excavate: what is dug away")
    surcharge: Surcharge | None = quantity(None, meaning="kind surcharge: what is put upon the ground")
    boundary: list[Boundary] = Field(default_factory=list, description="what holds, moves or loads sides from this stage on")
    wall: list[StageWall] = Field(default_factory=list, description="walls that move otherwise from this stage on")
    large_strain: Literal[True] | None = quantity(None, meaning="zones follow their gridpoints from this stage on")
    time: Literal["static", "real"] = quantity("static", meaning="scaled masses on the way to rest, or real masses and seconds")
    step_factor: float | None = quantity(
        None, meaning="time = real: share of the stable step (grid 0.5, discs their time_step; coupled: the shorter)", gt=0, le=1
    )
    discard: bool = quantity(False, meaning="forget the outcome: the next stage starts where this one did")

    @property
    def in_real_time(self):
        """Whether it computes real masses and seconds; else scaled masses on the way to rest (static mode)."""
        return self.time == "real"

    @model_validator(mode="before")
    @classmethod
    def _kind_from_name(cls, data):
        if isinstance(data, dict) and "kind" not in data and "name" in data:
            return {**data, "kind": data["name"]}
        return data
