"""A scene: the computation that a TOML file describes, as an immutable object.

Tables of effects are not listed here. Each is in an effect file of a server, with its equation, and is found through the
entry-point group `colluvium.effects`; the name of the entry point is the place of the table.
"""

import hashlib
import json
from functools import cache
from itertools import pairwise
from typing import Any, Literal

from pydantic import Field, PrivateAttr, create_model

from coupler_protocol.exits import EnvironmentFailed
from coupler_protocol.scene.declare import Table, quantity
from coupler_protocol.scene.installed import distribution, installed, loaded
from coupler_protocol.scene.named_files import that_computes
from coupler_protocol.scene.names import Title
from coupler_protocol.scene.tables.accuracy import Accuracy
from coupler_protocol.scene.tables.boundary import Boundary, InitialStress
from coupler_protocol.scene.tables.calibrate import Calibrate
from coupler_protocol.scene.tables.changes import (
    StageDiscs,
    StageGrain,
    StageMaterial,
    StagePair,
    StageRing,
    change_of,
    optional_fields,
)
from coupler_protocol.scene.tables.discs import Discs
from coupler_protocol.scene.tables.fos import FactorOfSafety
from coupler_protocol.scene.tables.grid import Grid
from coupler_protocol.scene.tables.lab import Lab
from coupler_protocol.scene.tables.materials import Grain, Material, Pair, Ring
from coupler_protocol.scene.tables.measure import Measure
from coupler_protocol.scene.tables.stages import Stage, time_axis
from coupler_protocol.scene.tables.stones import Stones
from coupler_protocol.scene.tables.windows import Window, WindowDiscs, WindowGrain, WindowPair

FORMAT = 1
DAMPING = "damping of the grid in this stage (none: that of the scene); in real time its local part also applies to the discs"


@cache
def declared_effects() -> dict[str, Any]:
    """All installed effects: {place in the scene: class that declares the table's keys}.

    Raises EnvironmentFailed if two distributions declare an effect for the same place: one of them would be lost.
    """
    found = sorted(installed("colluvium.effects"), key=lambda point: (point.name, distribution(point)))
    twice = [
        f"{one.name} is declared by the installed distributions {distribution(one)!r} and {distribution(other)!r}"
        for one, other in pairwise(found)
        if one.name == other.name
    ]
    if twice:
        raise EnvironmentFailed(f"{'; '.join(twice)}: uninstall one of them, or let it declare another place")
    return {point.name: loaded(point) for point in found}


def distribution_of(place: str) -> str:
    """Name of the distribution that declares the effect of this place; "" if it is unknown."""
    return _distributions().get(place, "")


@cache
def _distributions() -> dict[str, str]:
    """Names of the distributions that declare effects, by the places of these."""
    return {point.name: distribution(point) for point in installed("colluvium.effects")}


def _effect_fields(place: str) -> dict[str, Any]:
    """Optional fields for the effects below `place` ("material" gives elastic, mohr_coulomb, ...)."""
    inside = {name.partition(".")[2]: cls for name, cls in declared_effects().items() if name.startswith(place + ".")}
    return {
        name: (cls | None, Field(default=None, description=(cls.__doc__ or "").strip().splitlines()[0]))
        for name, cls in inside.items()
    }


def _change_fields(place: str, words: str = "{}: keys that change; false: the effect ends") -> dict[str, Any]:
    """Optional fields for changes of the effects below `place`; words: their description, {}: that of the effect."""
    inside = {name.partition(".")[2]: cls for name, cls in declared_effects().items() if name.startswith(place + ".")}
    return {
        name: (change_of(cls) | None, Field(default=None, description=words.format((cls.__doc__ or "").strip().splitlines()[0])))
        for name, cls in inside.items()
    }


class Coupling(Table):
    """Transfer of motion and force across the interface."""

    mapping: Literal["work-consistent", "paper"] = quantity(
        "work-consistent", meaning="docs/theory.md gives the quantities that each conserves"
    )
    exchange_every: int = quantity(
        1, unit="steps", meaning="steps between exchanges, at most, in static mode (docs/theory.md gives the limits)", ge=1, le=50
    )
    substeps: int = quantity(1, unit="steps", meaning="steps of the discs in one step of the grid, in real time", ge=1, le=50)


class Link(Table):
    """Clocks of the connection (docs/protocol.md lists all waits), and the way of its step messages."""

    lane: bool | None = quantity(
        None,
        meaning="step messages over a plain TCP connection beside the link, faster, readable on the network; "
        "if left out: only if both sides are on one machine",
    )

    timeout: float = quantity(5.0, unit="s", meaning="silence after which the last message is sent again", gt=0)
    give_up: float = quantity(120.0, unit="s", meaning="time without a connection after which the peer is considered lost", gt=0)
    arrival: float = quantity(1200.0, unit="s", meaning="for the other side to start and to join the run", gt=0)
    progress: float = quantity(
        600.0,
        unit="s",
        meaning="without PROGRESS of a connected peer that computes between the handshake and the first step",
        gt=0,
    )
    step: float = quantity(1200.0, unit="s", meaning="for a connected peer to answer a step, also the last of a stage", gt=0)
    phase: float = quantity(86400.0, unit="s", meaning="for any of these phases, in spite of PROGRESS", gt=0)
    farewell: float = quantity(60.0, unit="s", meaning="for the discs to close their files and to say FAREWELL", gt=0)


class Record(Table):
    """Recorded data and their intervals."""

    every: int = quantity(200, unit="steps", meaning="steps between frames", ge=1)
    history: int = quantity(10, unit="steps", meaning="steps between points of the histories", ge=1)
    measure: int = quantity(100, unit="steps", meaning="steps between values of the regions in `[[measure]]`", ge=1)
    checkpoint: float = quantity(
        240.0,
        unit="s",
        meaning="wall time between checkpoints inside of a stage, more where they would take a hundredth of it; 0: none",
        ge=0,
    )
    checkpoint_steps: int | None = quantity(None, unit="steps", meaning="steps between checkpoints inside of a stage", ge=2)
    trace: int | None = quantity(
        None,
        unit="steps",
        meaning="number of steps of each stage for which both sides record when they computed, waited and recorded",
        ge=1,
    )
    energy: bool = quantity(
        False,
        meaning="histories of energy and work since the start of each stage, for the grid (small strain) and for coupled discs",
    )


@cache
def scene_class() -> Any:
    """The class of scenes, with all installed effects in their places; mypy cannot use classes made at run time as types."""
    grain = _effect_fields("grain")
    material, discs_material = _extended(Material, **_effect_fields("material")), _extended(Grain, **grain)
    ring, pair, window = _extended(Ring, **grain), _extended(Pair, **grain), _window_class()
    discs = _extended(
        Discs,
        soil=(discs_material, quantity(meaning="material of the discs")),
        stone=(discs_material | None, quantity(None, meaning="material of the discs in stones")),
        pair=(
            list[pair],  # type: ignore[valid-type]
            Field(default_factory=list, description="values for contacts between two materials"),
        ),
        **_effect_fields("discs"),
    )
    damping = declared_effects()["damping"] | None
    stage = _extended(Stage, damping=(damping, Field(default=None, description=DAMPING)), **_changes_of_a_stage())
    return create_model(
        "Scene",
        __base__=SceneBase,
        material=(
            list[material],  # type: ignore[valid-type]
            Field(default_factory=list, description="soils of the continuum"),
        ),
        discs=(discs | None, Field(default=None, description="discs that fill the windows")),
        window=(
            list[window],  # type: ignore[valid-type]
            Field(default_factory=list, description="windows of discs, rank 1 onwards"),
        ),
        ring=(
            ring | None,
            Field(default=None, description="properties of contacts with control discs; none: bonded, properties of the disc"),
        ),
        damping=(damping, Field(default=None, description="damping of the grid")),
        stage=(
            list[stage],  # type: ignore[valid-type]
            Field(description="the procedure, in order", min_length=1),
        ),
    )


def _changes_of_a_stage() -> dict[str, Any]:
    """Fields of a stage with the tables that change effects (coupler_protocol.scene.tables.changes)."""
    grain = _change_fields("grain")
    of_discs, pair = _extended(StageGrain, **grain), _extended(StagePair, **grain)
    material = _extended(StageMaterial, **_change_fields("material"))
    discs = _extended(
        StageDiscs,
        soil=(of_discs | None, Field(default=None, description="material of the discs")),
        stone=(of_discs | None, Field(default=None, description="material of the discs in stones")),
        pair=(
            list[pair],  # type: ignore[valid-type]
            Field(default_factory=list, description="values for contacts between two materials"),
        ),
        **_change_fields("discs"),
    )
    ring = _extended(StageRing, **grain)
    return {
        "material": (
            list[material],  # type: ignore[valid-type]
            Field(default_factory=list, description="materials of the grid that change from this stage on"),
        ),
        "discs": (discs | None, Field(default=None, description="effects of discs that change from this stage on")),
        "ring": (
            ring | None,
            Field(default=None, description="effects of contacts with the ring that change from this stage on"),
        ),
    }


def _window_class() -> Any:
    """The class of windows, with all effects that a window's own discs may have."""
    words = "{}: keys that differ; false: without it"
    effects = _change_fields("grain", words)
    grain, pair = _extended(WindowGrain, **optional_fields(Grain), **effects), _extended(WindowPair, **effects)
    discs = _extended(
        WindowDiscs,
        **{name: field for name, field in optional_fields(Discs).items() if name != "wall"},
        soil=(grain | None, Field(default=None, description="material of the discs")),
        stone=(grain | None, Field(default=None, description="material of the discs in stones")),
        pair=(
            list[pair],  # type: ignore[valid-type]
            Field(default_factory=list, description="values for contacts between two materials"),
        ),
        **_change_fields("discs", words),
    )
    own = "discs of this window: what differs from `[discs]`; no table: nothing differs"
    return _extended(Window, discs=(discs | None, Field(default=None, description=own)))


def _extended(table: type[Table], **fields: Any) -> Any:
    """The class of a table with more fields, under its own name."""
    return create_model(table.__name__, __base__=table, __doc__=table.__doc__, **fields)


class SceneBase(Table):
    """What is computed: grid, materials, windows, discs, stages."""

    format: Literal[1] = quantity(meaning="version of the scene format")
    title: Title = quantity("", meaning="shown in pictures and logs")
    seed: int = quantity(meaning="every random choice derives from it, by name", ge=0, lt=2**63)
    units: Literal["SI", "any"] = quantity(
        "SI",
        meaning="SI: values that no soil or rock has in the units of this page are doubted, and several together refused; "
        "any: no value is doubted, for scenes in another consistent set of units or without units",
    )
    grid: Grid | None = Field(default=None, description="mesh of the continuum; no table: discs alone")
    boundary: list[Boundary] = Field(default_factory=list, description="sides of the grid that are fixed, moved or loaded")
    initial_stress: InitialStress | None = Field(default=None, description="stress before the first stage; no table: none")
    window: list[Window] = Field(default_factory=list, description="windows of discs, rank 1 onwards")
    stones: Stones | None = Field(default=None, description="stones in the windows; no table: none")
    measure: list[Measure] = Field(default_factory=list, description="regions in which discs are measured; no table: none")
    coupling: Coupling = Field(default=Coupling(), description="transfer of motion and force across the interface")
    link: Link = Field(default=Link(), description="clocks of the connection")
    record: Record = Field(default=Record(), description="recorded data and their intervals")
    fos: FactorOfSafety = Field(default=FactorOfSafety(), description="search for a factor of safety")
    lab: Lab = Field(default=Lab(), description="samples and loading of laboratory tests")
    calibrate: Calibrate | None = Field(
        default=None, description="targets and free parameters of a calibration; no table: defaults"
    )
    accuracy: Accuracy | None = Field(default=None, description="closed forms of quantities; no table: none")
    stage: list[Stage] = Field(description="the procedure, in order", min_length=1)

    _drawn: Any = PrivateAttr(None)
    _origin: tuple[float, float] = PrivateAttr((0.0, 0.0))

    @property
    def drawn(self) -> Any:
        """The scene in the coordinates of its file: this one, or the one of which this one is a local copy."""
        return self if self._drawn is None else self._drawn

    @property
    def origin(self) -> tuple[float, float]:
        """Point of the scene as drawn from which the coordinates of this one count (coupler_protocol.scene.local_origin)."""
        return self._origin

    def note_drawn(self, drawn: Any, origin: tuple[float, float]) -> None:
        """Stores that this scene is a copy of the scene `drawn` whose coordinates count from `origin` (2,) [m]."""
        self._drawn, self._origin = drawn, origin

    def resolved(self) -> dict[str, Any]:
        """The scene as drawn, as plain data with all defaults."""
        return self.drawn.model_dump(mode="json")

    def digest(self) -> str:
        """Hash of the resolved scene: equal for scenes with the same results."""
        return hashlib.sha256(json.dumps(that_computes(self.resolved()), sort_keys=True).encode()).hexdigest()

    @property
    def time_axis(self) -> str:
        """What ParaView takes for the time of a frame: "time" [s] if all stages compute in real time, else "step"."""
        return time_axis((stage.kind, stage.time) for stage in self.stage)

    def name_of_stage(self, index: int) -> str:
        """Name of the stage with this number."""
        return self.stage[index].name
