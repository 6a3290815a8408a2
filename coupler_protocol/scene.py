"""A scene: what is computed, read from a TOML file into an immutable object.

Tables of effects are not listed here. Each stands with its equation in a server's effect file and is found through the
entry-point group `colluvium.effects`; the name of the entry point says where the table belongs.
"""

import hashlib
import json
from functools import cache
from importlib.metadata import entry_points
from itertools import pairwise
from typing import Annotated, Literal

from pydantic import AfterValidator, BeforeValidator, Field, create_model, model_validator

from coupler_protocol.boundary_tables import Boundary, InitialStress
from coupler_protocol.declare import Table, quantity
from coupler_protocol.fos_table import FactorOfSafety
from coupler_protocol.grid_tables import Grid, Point

FORMAT = 1
GRID_ONLY = ("equilibrium", "locate")
STAGE_KINDS = (*GRID_ONLY, "fill", "couple", "overload", "excavate", "surcharge", "load", "discs")


@cache
def declared_effects():
    """All effects that are installed: {place in the scene: class that declares the table's keys}."""
    found = entry_points(group="colluvium.effects")
    return {point.name: point.load() for point in sorted(found, key=lambda p: p.name)}


def _effect_fields(place):
    """Optional fields for the effects below `place` ("material" gives elastic, mohr_coulomb, ...)."""
    inside = {name.partition(".")[2]: cls for name, cls in declared_effects().items() if name.startswith(place + ".")}
    return {
        name: (cls | None, Field(default=None, description=(cls.__doc__ or "").strip().splitlines()[0]))
        for name, cls in inside.items()
    }


def _constant(value):
    return {"to": value} if isinstance(value, int | float) and not isinstance(value, bool) else value


Span = tuple[Annotated[int, Field(ge=0)], Annotated[int, Field(ge=0)]]


class Window(Table):
    """Zones that become a hole and are computed by one discrete process; without a grid, the polygon that discs fill."""

    name: str = quantity(meaning="name of the window", min_length=1)
    columns: Span | None = quantity(None, meaning="first and last zone in x, from 0")
    rows: Span | None = quantity(None, meaning="first and last zone in y, from 0")
    polygon: list[Point] | None = quantity(None, unit="m", meaning="without a grid: outline of what discs fill", min_length=3)

    @model_validator(mode="after")
    def _in_order(self):
        if any(span is not None and span[0] > span[1] for span in (self.columns, self.rows)):
            raise ValueError("columns and rows are [first, last] with first <= last")
        return self


class Wall(Table):
    """A segment that holds discs back, in scenes without a grid; its contacts are of the material ring."""

    ends: tuple[Point, Point] = quantity(unit="m", meaning="where it begins and ends")
    velocity: Point = quantity((0.0, 0.0), unit="m/s", meaning="its velocity, in static stages in m a step")


class StoneSize(Table):
    """Lognormal sizes of stones: diameters of circles of equal area."""

    mean: float = quantity(unit="m", meaning="mean of the distribution before sizes beyond min and max are left out", gt=0)
    sigma: float = quantity(meaning="standard deviation of ln(size)", gt=0, le=2)
    min: float = quantity(unit="m", meaning="smallest size", gt=0)
    max: float = quantity(unit="m", meaning="largest size", gt=0)

    @model_validator(mode="after")
    def _in_order(self):
        if not self.min < self.mean < self.max:
            raise ValueError("min, mean and max must be in increasing order")
        return self


def _increasing(value):
    if value[0] > value[1]:
        raise ValueError("the first number must not be larger than the second")
    return value


def _rightwards(line):
    if any(b[0] <= a[0] for a, b in pairwise(line)):
        raise ValueError("points must follow each other from left to right")
    return line


Corners = Annotated[int, Field(ge=4, le=64)]
Flatness = Annotated[float, Field(ge=1, le=5)]


class Stones(Table):
    """Stones among the discs of every window: random polygons, convex and concave."""

    content: float = quantity(meaning="area of the stones over area of the window", gt=0, le=0.75)
    body: Literal["clump", "cluster"] = quantity("clump", meaning="rigid, or discs bonded to each other that can break")
    size: StoneSize = Field(description="lognormal sizes")
    vertices: Annotated[tuple[Corners, Corners], AfterValidator(_increasing)] = quantity(
        (6, 12), meaning="least and largest number of corners"
    )
    flatness: Annotated[tuple[Flatness, Flatness], AfterValidator(_increasing)] = quantity(
        (1.0, 1.8), meaning="least and largest ratio of long to short axis"
    )
    gap: float = quantity(0.0, unit="m", meaning="least distance between stones, and to the window's edge", ge=0)


class Coupling(Table):
    """How motion and force cross the interface."""

    mapping: Literal["work-consistent", "paper"] = quantity("work-consistent", meaning="docs/theory.md says what each keeps")
    exchange_every: int = quantity(1, unit="steps", meaning="steps between exchanges", ge=1, le=1)


class Link(Table):
    """Clocks of the connection."""

    timeout: float = quantity(5.0, unit="s", meaning="silence after which the last message is sent again", gt=0)
    give_up: float = quantity(120.0, unit="s", meaning="silence after which the peer counts as lost", gt=0)


class Record(Table):
    """What is written how often."""

    every: int = quantity(200, unit="steps", meaning="steps between frames", ge=1)
    history: int = quantity(10, unit="steps", meaning="steps between points of the histories", ge=1)
    energy: bool = quantity(False, meaning="histories of the grid's energies and works since each stage began (small strain)")


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

    columns: Annotated[Span, AfterValidator(_increasing)] | None = quantity(None, meaning="first and last zone in x, from 0")
    rows: Annotated[Span, AfterValidator(_increasing)] | None = quantity(None, meaning="first and last zone in y, from 0")
    polygon: list[Point] | None = quantity(None, unit="m", meaning="outline of what is dug away", min_length=3)
    over: int = quantity(1, unit="steps", meaning="steps over which the ground is relieved of what the zones carried", ge=1)

    @model_validator(mode="after")
    def _one_way(self):
        if (self.columns is None) != (self.rows is None) or (self.columns is None) == (self.polygon is None):
            raise ValueError("give columns and rows, or a polygon")
        return self


class Surcharge(Table):
    """Pressure upon the ground surface, added to what is there; its direction stays."""

    x: Annotated[Point, AfterValidator(_increasing)] = quantity(unit="m", meaning="where it begins and ends")
    pressure: float = quantity(unit="Pa", meaning="pressure, normal to the surface", gt=0)
    over: int = quantity(1, unit="steps", meaning="steps over which it grows", ge=1)


class Stage(Table):
    """One step of the procedure."""

    name: str = quantity(meaning="name of the stage; also its kind where no kind is given", min_length=1)
    kind: Literal[STAGE_KINDS] = quantity(
        meaning="equilibrium: the grid alone comes to rest, then displacements count from zero; locate: the grid alone, to be "
        "discarded or not; load: sides are held, moved or loaded anew; overload: gravity changes; excavate, surcharge: below; "
        "fill: discs for the windows; couple: discs take over from the windows' zones; discs: without a grid, the discs alone"
    )
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
    large_strain: Literal[True] | None = quantity(None, meaning="zones follow their gridpoints from this stage on")
    time: Literal["static", "real"] = quantity("static", meaning="scaled masses on the way to rest, or real masses and seconds")
    step_factor: float | None = quantity(None, meaning="time = real: share of the stable step that is taken (0.5)", gt=0, le=1)
    discard: bool = quantity(False, meaning="forget the outcome: the next stage starts where this one did")

    @model_validator(mode="before")
    @classmethod
    def _kind_from_name(cls, data):
        if isinstance(data, dict) and "kind" not in data and "name" in data:
            return {**data, "kind": data["name"]}
        return data


@cache
def scene_class():
    """The class of scenes, with all installed effects in their places."""
    grain = _effect_fields("grain")
    material = create_model(
        "Material",
        __base__=Table,
        __doc__="A soil of the continuum; a zone is of the last material whose region (or ground below `top`) holds its centre.",
        name=(str, quantity(meaning="name of the material", min_length=1)),
        density=(float, quantity(unit="kg/m3", meaning="density", gt=0)),
        region=(list[Point] | None, quantity(None, unit="m", meaning="polygon it fills; none: everywhere", min_length=3)),
        top=(
            Annotated[list[Point], AfterValidator(_rightwards)] | None,
            quantity(
                None,
                unit="m",
                meaning="line from left to right below which it fills the ground (level beyond its ends), in place of a region; "
                'with fit = "profile" zones follow it where they can stay good, elsewhere their centre decides',
                min_length=1,
            ),
        ),
        **_effect_fields("material"),
    )
    discs_material = create_model(
        "Grain",
        __base__=Table,
        __doc__="Material of discs.",
        density=(float, quantity(unit="kg/m3", meaning="density of the discs", gt=0)),
        **grain,
    )
    ring = create_model("Ring", __base__=Table, __doc__="Properties of contacts with control discs.", **grain)
    pair = create_model(
        "Pair",
        __base__=Table,
        __doc__="Contacts between two materials of discs; a table here goes before what both materials combine to.",
        between=(
            tuple[Literal["soil", "stone", "ring"], Literal["soil", "stone", "ring"]],
            quantity(meaning="the two materials"),
        ),
        **grain,
    )
    discs = create_model(
        "Discs",
        __base__=Table,
        __doc__="What fills a window.",
        radius=(float, quantity(unit="m", meaning="mean radius", gt=0)),
        spread=(float, quantity(0.25, meaning="radii are uniform in radius (1 -+ spread)", ge=0, lt=0.8)),
        packing=(Literal["relaxed", "inward"], quantity("relaxed", meaning="spread and relaxed, or placed from the ring inward")),
        porosity=(float, quantity(0.16, meaning="porosity aimed at; packing inward fills what it can", gt=0.1, lt=0.4)),
        confinement=(float, quantity(100e3, unit="Pa", meaning="mean pressure of the fresh packing", gt=0)),
        density_matching=(bool, quantity(True, meaning="discs weigh what the zones they replace weighed")),
        stiffness=(Literal["disc", "contact"], quantity("disc", meaning="springs belong to discs (in series) or to contacts")),
        time_step=(
            float,
            quantity(0.1, meaning="time = real without a grid: share of the stable step, unless the stage says", gt=0, le=1),
        ),
        file=(str | None, quantity(None, meaning="without a grid: CSV file of the discs (x, y, radius, vx, vy, spin)")),
        wall=(list[Wall], Field(default_factory=list, description="without a grid: segments that hold the discs")),
        soil=(discs_material, quantity(meaning="material of the discs")),
        stone=(discs_material | None, quantity(None, meaning="material of the discs in stones")),
        pair=(list[pair], Field(default_factory=list, description="contacts between two materials that have their own values")),
        **_effect_fields("discs"),
    )
    damping = declared_effects()["damping"] | None
    stage = create_model(
        "Stage",
        __base__=Stage,
        __doc__=Stage.__doc__,
        damping=(damping, Field(default=None, description="damping of the grid in this stage; none: the scene's")),
    )
    return create_model(
        "Scene",
        __base__=SceneBase,
        material=(list[material], Field(default_factory=list, description="soils of the continuum")),
        discs=(discs | None, Field(default=None, description="what fills the windows")),
        ring=(ring | None, Field(default=None, description="contacts of the ring; none: bonded, the discs' own properties")),
        damping=(damping, Field(default=None, description="damping of the grid")),
        stage=(list[stage], Field(description="the procedure, in order", min_length=1)),
    )


class SceneBase(Table):
    """What is computed: grid, materials, windows, discs, stages."""

    format: Literal[1] = quantity(meaning="version of the scene format")
    title: str = quantity("", meaning="shown in pictures and logs")
    seed: int = quantity(meaning="every random choice derives from it, by name", ge=0, lt=2**63)
    grid: Grid | None = Field(default=None, description="the continuum's mesh; no table: discs alone")
    boundary: list[Boundary] = Field(default_factory=list, description="what holds, moves or loads sides of the grid")
    initial_stress: InitialStress | None = Field(default=None, description="stress before the first stage; no table: none")
    window: list[Window] = Field(default_factory=list, description="windows of discs, rank 1 onwards")
    stones: Stones | None = Field(default=None, description="stones in the windows; no table: none")
    coupling: Coupling = Field(default=Coupling(), description="how motion and force cross the interface")
    link: Link = Field(default=Link(), description="clocks of the connection")
    record: Record = Field(default=Record(), description="what is written how often")
    fos: FactorOfSafety = Field(default=FactorOfSafety(), description="how a factor of safety is looked for")
    stage: list[Stage] = Field(description="the procedure, in order", min_length=1)

    def resolved(self):
        """The scene as plain data, every default filled in."""
        return self.model_dump(mode="json")

    def digest(self):
        """Hash of the resolved scene: equal where both sides would compute the same."""
        return hashlib.sha256(json.dumps(self.resolved(), sort_keys=True).encode()).hexdigest()

    def name_of_stage(self, index):
        """Name of the stage with this number."""
        return self.stage[index].name
