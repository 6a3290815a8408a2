"""Schema of run.json. docs/output.md describes its use."""

from typing import Any

from pydantic import BaseModel, ConfigDict, Field


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid")


class StageSeconds(_Part):
    """Wall seconds of a stage; zero for a side that the scene does not have."""

    continuum: float
    waiting: float
    recording: float
    discrete: float
    waiting_discrete: float
    recording_discrete: float


class StageRow(_Part):
    """A stage that was computed, or in which the run failed (then `ended_by` is "", as for a stage without steps)."""

    name: str
    kind: str
    steps: int
    ended_by: str
    gravity: float
    gravity_factor: float
    seconds_simulated: float | None = Field(description="in real time; None in static mode")
    time_step: float | None
    ratio_discrete: list[float]
    bonds_broken: list[int]
    seconds: StageSeconds
    # with a grid
    ratio_continuum: float | None = None
    reactions: Any = None
    # coupled
    traction_difference: list[float] | None = None
    limits: dict[str, Any] | None = None
    rim_stretched: dict[str, Any] | None = None
    exchanges: int | None = None
    fell_back: str | None = None


class Warned(_Part):
    """A warning of a coupled stage."""

    stage: str
    step: int
    name: str
    text: str


class Doubted(_Part):
    """Something about the scene that may not be meant, as of `colluvium check`."""

    key: str
    what: str
    remedy: str


class BeginsAfter(_Part):
    """Stage of an earlier run after which this run begins."""

    run: str
    stage: str


class RunJson(_Part):
    """All of run.json. If a server was killed, it has only exit code, reason and stages."""

    exit_code: int
    reason: str
    stages: list[StageRow]
    title: str = ""
    scene_hash: str = ""
    seed: int = 0
    versions: dict[str, str] = {}
    cpu: str = ""
    host: str = ""
    start: str = ""
    end: str = ""
    seconds: float = 0.0
    peak_memory_MB: float = 0.0  # noqa: N815
    begins_after: BeginsAfter | None = None
    plugin: str | None = None
    attempts: list[dict[str, Any]] | None = None
    warnings: list[Warned] | None = None
    doubts: list[Doubted] | None = None
    # with a grid
    steps: int | None = None
    gridpoints: int | None = None
    zones: int | None = None
    windows: list[dict[str, Any]] = []
    # by colluvium run
    locate: Any = None
    band: Any = None
