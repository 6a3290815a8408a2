"""Schema of run.json: every key with its unit and meaning. All that is written must fit it; docs/output.md has its tables."""

from typing import Any

from pydantic import BaseModel, ConfigDict

from coupler_protocol.scene.declare import quantity


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid")


class StageSeconds(_Part):
    """Wall-clock seconds of a stage; zero for a side that the scene does not have."""

    continuum: float = quantity(unit="s", meaning="the grid computes")
    waiting: float = quantity(unit="s", meaning="the grid waits for the discs; in a fill stage: the windows are packed")
    recording: float = quantity(unit="s", meaning="the grid records")
    discrete: float = quantity(unit="s", meaning="the discs compute; the slowest window")
    waiting_discrete: float = quantity(unit="s", meaning="the discs wait for the grid; the longest wait of a window")
    recording_discrete: float = quantity(unit="s", meaning="the discs record; the slowest window")


class Limit(_Part):
    """Safe limit of the step."""

    share: float = quantity(meaning="longest stable step as a multiple of the step in use")
    dt: float | None = quantity(unit="s", meaning="step in use; null in static mode")
    what: str = quantity(meaning="zone, gridpoint or disc that sets the limit")
    at: list[float] = quantity(unit="m", meaning="its position")


class Stretched(_Part):
    """The zone at a window's rim that is stretched most."""

    zone: int = quantity(meaning="number of the zone")
    stretch: float = quantity(meaning="largest length of a line in the zone over its initial length")
    place: list[float] = quantity(unit="m", meaning="middle of the zone")


class Changes(_Part):
    """What a stage changes from its start on."""

    what: list[str] = quantity(meaning="the keys that change, with the values before and after")
    strain_energy: list[float] | None = quantity(
        None, unit="J", meaning="if materials of the grid change: strain energy of the grid before and after the change"
    )
    stored_energy: list[float] | None = quantity(
        None, unit="J", meaning="if discs without a grid change: energy stored in their contacts before and after the change"
    )
    bonds_made: int | None = quantity(None, meaning="if discs without a grid change: bonds made at the start of the stage")


class StageRow(_Part):
    """A stage that was computed, or the one in which the run failed."""

    name: str = quantity(meaning="name of the stage")
    kind: str = quantity(meaning="its kind")
    steps: int = quantity(unit="steps", meaning="steps of the stage")
    ended_by: str = quantity(meaning="the condition that ended it; empty for a stage without steps and where the run failed")
    gravity: float = quantity(unit="m/s2", meaning="gravity without its factor")
    gravity_factor: float = quantity(meaning="factor of gravity in the last step")
    seconds_simulated: float | None = quantity(unit="s", meaning="time that passed in a stage in real time; null in static mode")
    time_step: float | None = quantity(unit="s", meaning="last step in real time; null in static mode")
    ratio_discrete: list[float] = quantity(meaning="unbalanced force ratio of the discs at the end, by window")
    bonds_broken: list[int] = quantity(meaning="bonds broken since the start, by window")
    seconds: StageSeconds = quantity(meaning="wall-clock seconds by side and activity")
    ratio_continuum: float | None = quantity(None, meaning="with a grid: unbalanced force ratio of the grid at the end")
    reactions: dict[str, dict[str, float]] | None = quantity(
        None, unit="N", meaning="with a grid: forces x and y of held and moved sides on the ground, by name of the boundary"
    )
    traction_difference: list[float] | None = quantity(
        None, meaning="coupled: rms difference between discs' tractions and zones' stress at the rim over the stress, by window"
    )
    limits: dict[str, Limit] | None = quantity(None, meaning="coupled: safe limits of the step by grid and interface")
    rim_stretched: Stretched | None = quantity(None, meaning="coupled: if a zone at a rim was stretched beyond the warning level")
    plain_steps: int | None = quantity(
        None, meaning="coupled: steps that the grid took in compiled calls of many steps ([performance](performance.md))"
    )
    one_by_one: str | None = quantity(
        None,
        meaning="coupled: why all steps, or those after the lane closed, came one by one ([list](performance.md))",
    )
    plain_steps_discrete: list[int] | None = quantity(None, meaning="coupled: such steps of the discs, by window")
    one_by_one_discrete: list[str] | None = quantity(
        None, meaning="coupled: why the discs took no step in such a call, by window; empty text if they did"
    )
    changes: Changes | None = quantity(None, meaning="if materials, discs, ring or record change in this stage")
    exchanges: int | None = quantity(None, meaning="with coupling.exchange_every above 1: exchanges of the stage")
    fell_back: str | None = quantity(
        None, meaning="with coupling.exchange_every above 1: why the stage returned to an exchange in every step, or empty"
    )


class Warned(_Part):
    """A warning of the watches of coupled stages, or of a stage that did not come to rest; once a stage and name."""

    stage: str = quantity(meaning="name of the stage")
    step: int = quantity(unit="steps", meaning="steps since the start of the run")
    name: str = quantity(meaning="growth, drift or mismatch ([theory](theory.md)), or `not at rest`")
    text: str = quantity(meaning="the warning")


class Doubted(_Part):
    """Something about the scene that may not be meant, as of `colluvium check`."""

    key: str = quantity(meaning="table or key of the scene")
    what: str = quantity(meaning="what is doubted")
    remedy: str = quantity(meaning="what would be right")


class CompiledFunction(_Part):
    """A function that was compiled in the run."""

    function: str = quantity(meaning="module and name")
    seconds: float = quantity(unit="s", meaning="processor time, without the functions that it calls")
    specialisations: int = quantity(meaning="number of times, for different types of arguments")


class Compiled(_Part):
    """Compilation of kernels that were not in the cache."""

    seconds: float = quantity(unit="s", meaning="processor time of all functions")
    functions: int = quantity(meaning="number of functions")
    most_expensive: list[CompiledFunction] = quantity(meaning="the ten that took most seconds")


class BeginsAfter(_Part):
    """The checkpoint from which a run continues: the end of a stage, or a step inside of it."""

    run: str = quantity(meaning="directory of the original run")
    stage: str = quantity(meaning="name of the stage")
    step: int | None = quantity(None, unit="steps", meaning="inside of a stage: steps since the start of the run")


class RunJson(_Part):
    """All of run.json. If a server was killed, it has only exit code, reason and stages."""

    exit_code: int = quantity(meaning="0: all stages done; otherwise why the run ended (`coupler_protocol/exits.py`)")
    reason: str = quantity(meaning="why the run ended")
    stages: list[StageRow] = quantity(meaning="one row a stage, in order; with those before a continuation")
    run: str = quantity("", meaning="number of the run, the same on both sides and after it was continued")
    title: str = quantity("", meaning="title of the scene")
    scene_hash: str = quantity("", meaning="hash of the resolved scene")
    seed: int = quantity(0, meaning="seed of the scene")
    versions: dict[str, str] = quantity({}, meaning="versions of Python, colluvium and its libraries")
    cpu: str = quantity("", meaning="name of the processor")
    host: str = quantity("", meaning="name of the machine")
    start: str = quantity("", meaning="time of day at the start, with its zone")
    end: str = quantity("", meaning="time of day at the end, with its zone")
    seconds: float = quantity(0.0, unit="s", meaning="wall-clock time of the whole run")
    peak_memory_MB: float = quantity(0.0, unit="MB", meaning="largest resident memory of the process that wrote the file")  # noqa: N815
    begins_after: BeginsAfter | None = quantity(None, meaning="if the run continues another: where it begins")
    plugin: str | None = quantity(None, meaning="if functions of a user were called: their file, or `functions`")
    attempts: list[dict[str, Any]] | None = quantity(
        None, meaning="if the run was resumed: start, end, seconds, exit code, reason, plugin and warnings of earlier attempts"
    )
    warnings: list[Warned] | None = quantity(None, meaning="if there were any: warnings of stages")
    doubts: list[Doubted] | None = quantity(None, meaning="if there were any: what of the scene is worth a second look")
    compiled: Compiled | None = quantity(None, meaning="if kernels were compiled: which took longest; by the grid or discs alone")
    steps: int | None = quantity(None, unit="steps", meaning="with a grid: steps of the run")
    gridpoints: int | None = quantity(None, meaning="with a grid: number of gridpoints")
    zones: int | None = quantity(None, meaning="with a grid: number of zones")
    computed_about: list[float] | None = quantity(
        None, unit="m", meaning="with a grid that does not begin at (0, 0): the point about which the scene is computed"
    )
    windows: list[dict[str, Any]] = quantity(
        [],
        meaning="for each window: name, packing, stones, initial stress, gaps of the ring, step limits, changes of the discs by "
        "stage, broken bonds, memory, compilation",
    )
    locate: Any = quantity(None, meaning="with `colluvium run`: where the band was at the end of the locate stage")
    band: Any = quantity(None, meaning="with `colluvium run`: whether the slope failed, and whether the band crosses the window")
