"""Going on from the end of a stage: where the checkpoints are, and whether they belong to the scene and to each other.

A checkpoint `NAME.STAGE.h5` of a run directory holds the State of one side at the end of a stage. As attributes it carries what
it belongs to: version, process, step, stage, phase, the resolved scene, and the session in which both sides computed that stage:
checkpoints of equal session and stage are of the same moment.

A damaged checkpoint is refused by its name (seal.py), and so is a State that no step can be taken with (`prove` of each side).
"""

import json
import logging
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

from coupler_protocol import exits
from coupler_protocol.files.proof import require
from coupler_protocol.problems import Problem, SceneError
from coupler_protocol.scene.differences import first_difference
from coupler_protocol.scene.named_files import without_paths
from coupler_protocol.scene.stage_kinds import number_of

log = logging.getLogger(__name__)
FUNCTIONS = "functions"  # name of a plugin that was made from functions, not a file
FREE = ("title", "units", "record", "link", "fos")  # keys of a scene by which no State differs
END = "end of step"  # phase of a State from which steps can go on; any other is for a person to look at


class Origin(NamedTuple):
    """Where to go on from: `DIR@STAGE` on the command line."""

    folder: Path
    stage: str

    @classmethod
    def parse(cls, text):
        """The origin of a command line's text; raises ValueError."""
        folder, at, stage = text.rpartition("@")
        if not at or not folder or not stage:
            raise ValueError(f"{text!r} is not of the form DIR@STAGE")
        return cls(Path(folder), stage)

    def __str__(self):
        return f"{self.folder}@{self.stage}"

    def path(self, name):
        """Checkpoint of the process `name` ("fdm.rank0", "dem.rank1", ...)."""
        return self.folder / f"{name}.{self.stage}.h5"

    def continues(self, out):
        """Whether a run into the folder `out` goes on with the run it comes from (else it branches off)."""
        return self.folder.resolve() == Path(out).resolve()


class Saved(NamedTuple):
    """A checkpoint as it was read: number of its stage in the scene, fields of its State, attributes, path."""

    index: int  # type: ignore[assignment]  # a tuple has a method of that name, which nobody calls here
    fields: dict[str, Any]
    about: dict[str, Any]
    path: Path

    def said(self, name, kind):
        """The attribute `name`, which went in as JSON; raises proof.UnprovenError where it is missing or of another kind."""
        value = json.loads(self.about.get(name, "null"))
        require(isinstance(value, kind), f"its attribute {name} is missing or of another kind")
        return value


def attributes(scene, process, stage, phase, step, session, factor, **more):
    """Attributes of a checkpoint of the process of this name; `factor`: the gravity factor; `more` goes in as JSON."""
    named = {"process": process, "stage": stage, "phase": phase, "step": step, "session": session, "gravity_factor": factor}
    named["version"] = version("colluvium")
    return named | {key: json.dumps(value) for key, value in {"scene": scene.resolved(), **more}.items()}


def named(plugin):
    """Attribute that names the functions of a user with which a State was computed."""
    return {} if plugin is None else {"plugin": plugin.name}


def check_plugin(scene, origin, plugin):
    """Raise EnvironmentFailed where a run that was computed with a file of functions would go on without any.

    Functions that were given from Python have no name to ask for: that they are missing only goes into the log.
    """
    from coupler_protocol.files import checkpoint

    found = checkpoint.attributes(origin.path(processes(scene, index_of(scene, origin))[0])).get("plugin")
    name = json.loads(found) if found else None
    if name is None or plugin is not None:
        return
    if name != FUNCTIONS:
        raise exits.EnvironmentFailed(f"{origin} was computed with the plugin {name}: give it again (--plugin {name})")
    log.warning("%s was computed with on_stage or on_step, the run goes on without them", origin)


def index_of(scene, origin):
    """Number of the stage to go on from; raises EnvironmentFailed where the scene has no such stage, or none after it."""
    names = [stage.name for stage in scene.stage]
    if origin.stage not in names:
        raise exits.EnvironmentFailed(f"{origin}: the scene has no stage {origin.stage!r}; it has {', '.join(names)}")
    if origin.stage == names[-1]:
        raise exits.EnvironmentFailed(f"{origin}: this is the last stage: nothing remains to be computed")
    return names.index(origin.stage)


def kept_stages(scene, origin):
    """Names of the stages whose outcome stays."""
    return [stage.name for stage in scene.stage[: index_of(scene, origin) + 1]]


def filled(scene, index):
    """Whether the discs exist after the stage with this number."""
    return number_of(scene.stage[: index + 1], fills=True) is not None


def coupled(scene, index):
    """Whether discs and grid are coupled after the stage with this number."""
    return number_of(scene.stage[: index + 1], couples=True) is not None


def processes(scene, index):
    """Names of the processes that save the end of the stage with this number."""
    if scene.grid is None:
        return ["dem.rank1"]
    return ["fdm.rank0", *(f"dem.rank{rank}" for rank in range(1, len(scene.window) + 1) if filled(scene, index))]


def load(scene, origin, name):
    """The checkpoint of the process `name` at `origin`, made sure to belong to `scene`: only later stages may differ.

    Raises EnvironmentFailed where there is none or where it is damaged, SceneError naming the first key that differs.
    """
    from coupler_protocol.files import checkpoint

    index, path = index_of(scene, origin), origin.path(name)
    if not path.is_file():
        raise exits.EnvironmentFailed(f"{path} does not exist: the end of this stage was not saved")
    try:
        fields, about = checkpoint.load(path)
    except checkpoint.DamagedError as error:
        raise exits.EnvironmentFailed(f"{error}. {instead_of(scene, origin.folder, index)}") from error
    if about.get("phase") != END:
        raise exits.EnvironmentFailed(f"{path} is not a checkpoint of the end of a stage")
    missing = [key for key in ("version", "process", "stage", "step", "session", "scene", "gravity_factor") if key not in about]
    if missing:
        raise exits.EnvironmentFailed(f"{path} is not a checkpoint of the end of a stage: it has no {', '.join(missing)}")
    if about["version"] != version("colluvium"):
        raise exits.EnvironmentFailed(f"{path} was written by version {about['version']}, this is {version('colluvium')}")
    if (about["process"], about["stage"]) != (name, origin.stage):
        of = f"of {about['process']} at the end of stage {about['stage']!r}"
        raise exits.EnvironmentFailed(f"{path} is a checkpoint {of}: files were exchanged or renamed")
    check_scene(scene, json.loads(about["scene"]), index, path)
    return Saved(index, fields, about, path)


def instead_of(scene, folder, index):
    """What can be done where a checkpoint of the stage with this number is damaged, in words: the last stage end before it."""
    folder = Path(folder)
    for earlier in reversed(range(index)):
        names = [name for name in processes(scene, earlier) if any(folder.glob(f"{name}.*.h5"))]
        stage = scene.name_of_stage(earlier)
        if names and all(_whole(Origin(folder, stage).path(name)) for name in names):
            return (
                f"The end of stage {stage!r} is whole: continue from there with --from {folder}@{stage}, or remove the damaged "
                "file and resume the run"
            )
    return "No earlier end of a stage is whole: compute the run from its start"


def _whole(path):
    """Whether a checkpoint is there as it was written."""
    from coupler_protocol.files import seal

    return path.is_file() and not seal.fault(path)


def check(scene, origin):
    """Make sure that all processes of `scene` can go on from `origin`; raises as `load` does."""
    names = processes(scene, index_of(scene, origin))
    found = {name: load(scene, origin, name).about["session"] for name in names}
    if len(set(found.values())) > 1:
        raise exits.EnvironmentFailed(f"{origin}: the checkpoints are of different runs: {', '.join(found)}")


def check_scene(scene, earlier, index, path):
    """Raise SceneError where `scene` differs from the resolved `earlier` in more than FREE and stages after `index`."""
    both = (without_paths(resolved) for resolved in (scene.resolved(), earlier))
    mine, theirs = (_bound(resolved, index) for resolved in both)
    found = first_difference(mine, theirs, ("this scene", str(path)))
    if found:
        may = f"only stages after {scene.name_of_stage(index)!r}, record and link may differ from the scene that was computed"
        why = f"{may}: {found}"
        raise SceneError([Problem("scene", None, found.partition(":")[0], why, "compute the scene from its start instead")])


def _bound(resolved, index):
    """What a run that goes on after the stage with number `index` must have in common with the one before."""
    stages = [{key: value for key, value in stage.items() if key != "record"} for stage in resolved["stage"][: index + 1]]
    return {key: value for key, value in resolved.items() if key not in FREE} | {"stage": stages}


def last_saved(scene, folder):
    """Origin of the last stage end that all processes of a run directory have saved; raises EnvironmentFailed without one."""
    for index in reversed(range(len(scene.stage))):
        origin = Origin(Path(folder), scene.stage[index].name)
        paths = [origin.path(name) for name in processes(scene, index)]
        if all(path.is_file() for path in paths):
            sessions = {_session(scene, path, index) for path in paths}
            if len(sessions) == 1 and None not in sessions:
                return origin
    raise exits.EnvironmentFailed(f"no stage in {folder} ended with checkpoints of all processes: run the scene again")


def _session(scene, path, index):
    """Session of a checkpoint of the end of the stage with this number, or None; raises EnvironmentFailed where it is damaged."""
    from coupler_protocol.files import checkpoint

    try:
        about = checkpoint.attributes(path)
    except checkpoint.DamagedError as error:
        raise exits.EnvironmentFailed(f"{error}. {instead_of(scene, path.parent, index)}") from error
    return about.get("session") if about.get("phase") == END else None


def part_file(scene, out, name, origin):
    """Path of the file for frames of the process `name`.

    A run that goes on in the directory of its origin adds a part to what is there; its checkpoints of later stages are removed.
    """
    if origin is None or not origin.continues(out):
        return Path(out) / f"{name}.vtkhdf"
    for stage in scene.stage[index_of(scene, origin) + 1 :]:
        (Path(out) / f"{name}.{stage.name}.h5").unlink(missing_ok=True)
    taken = len(list(Path(out).glob(f"{name}.part*.vtkhdf")))
    return Path(out) / f"{name}.part{taken + 1}.vtkhdf"
