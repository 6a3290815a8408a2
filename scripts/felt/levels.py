"""Levels of gravity held to rest, each a branch of the run of the level before, and the search for the first that moves.

A level grows to its gravity in `Hold.ramp` steps and is held. It rests if the unbalanced ratio falls below `Hold.ratio` within
`Hold.steps`; otherwise it moves. Whole levels follow each other until one moves. Then the last resting level and the first
moving one are brought together by bisection, in tenths of g; each trial begins at the last level at rest.
"""

import math
import sys
from collections.abc import Callable
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any, NamedTuple

from colluvium import cli
from colluvium.running import processes
from coupler_protocol.files import run_json
from coupler_protocol.scene.reader import build_scene, read_scene

BEGIN = "begin"  # folder of the stages up to 1 g
KEPT = ("equilibrium", "fill", "couple")  # kinds of the stages that bring a scene to 1 g
OF_WINDOWS = ("window", "discs", "stones", "ring", "coupling", "lab")  # tables that the continuum alone does not have
IDLE = ("title", "lab", "fos", "link")  # keys of a scene by which no run differs


class Hold(NamedTuple):
    """How levels are held."""

    ramp: int = 2000  # steps in which gravity grows
    steps: int = 40000  # most steps of a level
    ratio: float = 1e-5  # unbalanced ratio at rest
    last: int = 14  # [g] highest level
    resolution: float = 0.1  # [g] of the bisection
    gone: float = 1.0  # [m] displacement with which a level has failed


class Level(NamedTuple):
    """A level that was computed: gravity [g], folder of its run, name of its stage, whether it rests."""

    gravity: float
    folder: Path
    stage: str
    rests: bool


class Course(NamedTuple):
    """The levels of a run: those at rest in order of gravity, and those that move."""

    resting: list[Level]
    moving: list[Level]

    @property
    def rests_at(self) -> float:
        """Gravity [g] of the last level at rest."""
        return self.resting[-1].gravity

    @property
    def moves_at(self) -> float | None:
        """Gravity [g] of the first level that moves; None if none does."""
        return min((level.gravity for level in self.moving), default=None)

    def level(self, gravity: float) -> Level:
        """The level at rest under a gravity [g]; raises KeyError."""
        for level in self.resting:
            if math.isclose(level.gravity, gravity):
                return level
        raise KeyError(gravity)


def continuum_alone(scene: Any) -> Any:
    """The scene without its windows and discs."""
    tables = scene.model_dump(mode="json", exclude_none=True, warnings=False)
    kept = {key: value for key, value in tables.items() if key not in OF_WINDOWS}
    kept["stage"] = [stage for stage in tables["stage"] if stage.get("kind", stage["name"]) == "equilibrium"]
    return build_scene(kept)


def begun(scene: Any, every: int) -> Any:
    """The scene with those of its stages alone that bring it to 1 g, and a frame every so many steps."""
    tables = scene.model_dump(mode="json", exclude_none=True, warnings=False)
    tables["stage"] = [stage for stage in tables["stage"] if stage.get("kind", stage["name"]) in KEPT]
    tables["record"] = tables.get("record", {}) | {"every": every}
    return build_scene(tables)


def with_level(scene: Any, gravity: float, hold: Hold) -> Any:
    """The scene with one more stage, a level of gravity [g]."""
    tables = scene.model_dump(mode="json", exclude_none=True, warnings=False)
    until = {"ratio": hold.ratio, "steps": hold.steps, "displacement": hold.gone}
    stage = {"name": name_of(gravity), "kind": "overload", "large_strain": True, "until": until}
    tables["stage"].append(stage | {"gravity_factor": {"to": gravity, "over": hold.ramp}})
    return build_scene(tables)


def name_of(gravity: float) -> str:
    """Name of a level's stage and folder."""
    return f"{gravity:.4g} g"


def course(scene: Any, folder: Path, hold: Hold, compute: Callable[[Any, Path, Level | None], bool]) -> Course:
    """All levels of a scene that ends at 1 g, each in a folder of its own below `folder`.

    compute(scene, folder, before) computes the last stage of a scene as a branch of the level `before` and returns whether it
    came to rest.
    """
    first = Level(1.0, folder / BEGIN, scene.stage[-1].name, compute(scene, folder / BEGIN, None))
    found, scenes = Course([first], []), {1.0: scene}

    def held(gravity: float) -> bool:
        before = found.resting[-1]
        own = with_level(scenes[before.gravity], gravity, hold)
        at = folder / name_of(gravity).replace(" ", "_")
        level = Level(gravity, at, name_of(gravity), compute(own, at, before))
        (found.resting if level.rests else found.moving).append(level)
        scenes[gravity] = own
        return level.rests

    whole = 2
    while whole <= hold.last and held(float(whole)):
        whole += 1
    for gravity in bisection(found, hold.resolution):
        held(gravity)
    return found


def bisection(found: Course, resolution: float):
    """Yields the gravity [g] to try next, in multiples of the resolution, until no multiple lies between rest and motion."""
    while found.moves_at is not None:
        low, high = (round(gravity / resolution) for gravity in (found.rests_at, found.moves_at))
        if high - low < 2:
            return
        yield round((low + high) // 2 * resolution, 9)


def run_level(scene: Any, folder: Path, before: Level | None, in_process: bool = False) -> bool:
    """Computes a scene in two processes into `folder`, or reads what is there; whether its last stage came to rest.

    Raises SystemExit with the exit code if the run failed or was interrupted.
    """
    if not computed(scene, folder):
        folder.parent.mkdir(parents=True, exist_ok=True)
        path = folder.with_suffix(".toml") if not folder.suffix else folder.with_name(f"{folder.name}.toml")
        path.write_text(processes.as_toml(scene.model_dump(mode="json", exclude_none=True, warnings=False)), encoding="utf-8")
        words = ["run", str(path), "--out", str(folder), "--quiet", *(["--in-process"] if in_process else [])]
        words += ["--from", f"{before.folder}@{before.stage}"] if before else []
        with redirect_stdout(sys.stderr):
            code = cli.main([*words, "--json", str(folder.with_name(f"{folder.name}.json"))])
        if code:
            raise SystemExit(code)
    return rested(run_json.read(folder / run_json.NAME)["stages"][-1])


def computed(scene: Any, folder: Path) -> bool:
    """Whether a run of this scene is in `folder`, to its end."""
    if not (folder / run_json.NAME).exists() or run_json.read(folder / run_json.NAME).get("exit_code") != 0:
        return False
    return _without_idle(read_scene(folder / "scene.json")) == _without_idle(scene)


def _without_idle(scene: Any) -> Any:
    """The scene without tables that a run does not use."""
    return scene.model_copy(update=dict.fromkeys(IDLE))


def rested(stage: dict[str, Any]) -> bool:
    """Whether the row of a stage in run.json says that it ended at rest."""
    return stage["ended_by"].startswith("ratio")
