"""Going on from the end of a stage: where the checkpoints are, and whether they belong to the scene and to each other.

A checkpoint `NAME.STAGE.h5` of a run directory holds the State of one side at the end of a stage. As attributes it carries what
it belongs to: version, step, stage, phase, the resolved scene, and the session in which both sides computed that stage:
checkpoints of equal session and stage are of the same moment.
"""

import json
import logging
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

from coupler_protocol import exits
from coupler_protocol.problems import Problem, SceneError
from coupler_protocol.scene.differences import first_difference
from coupler_protocol.scene.stage_kinds import number_of

log = logging.getLogger(__name__)
FUNCTIONS = "functions"  # name of a plugin that was made from functions, not a file
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
    """A checkpoint as it was read: number of its stage in the scene, fields of its State, attributes."""

    index: int  # type: ignore[assignment]  # a tuple has a method of that name, which nobody calls here
    fields: dict[str, Any]
    about: dict[str, Any]


def attributes(scene, stage, phase, step, session, factor, **more):
    """Attributes of a checkpoint; `factor`: the gravity factor; `more` goes in as JSON."""
    named = {"stage": stage, "phase": phase, "step": step, "session": session, "gravity_factor": factor}
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

    Raises EnvironmentFailed where there is none, SceneError naming the first key that differs.
    """
    from coupler_protocol.files import checkpoint

    index, path = index_of(scene, origin), origin.path(name)
    if not path.is_file():
        raise exits.EnvironmentFailed(f"{path} does not exist: the end of this stage was not saved")
    about = checkpoint.attributes(path)
    if about.get("phase") != END:
        raise exits.EnvironmentFailed(f"{path} is not a checkpoint of the end of a stage")
    if about["version"] != version("colluvium"):
        raise exits.EnvironmentFailed(f"{path} was written by version {about['version']}, this is {version('colluvium')}")
    check_scene(scene, json.loads(about["scene"]), index, path)
    return Saved(index, checkpoint.load(path)[0], about)


def check(scene, origin):
    """Make sure that all processes of `scene` can go on from `origin`; raises as `load` does."""
    names = processes(scene, index_of(scene, origin))
    found = {name: load(scene, origin, name).about["session"] for name in names}
    if len(set(found.values())) > 1:
        raise exits.EnvironmentFailed(f"{origin}: the checkpoints are of different runs: {', '.join(found)}")


def check_scene(scene, earlier, index, path):
    """Raise SceneError where `scene` differs from the resolved `earlier` in more than title and stages after `index`."""
    now = scene.resolved()
    mine, theirs = (resolved | {"title": "", "stage": resolved["stage"][: index + 1]} for resolved in (now, earlier))
    found = first_difference(mine, theirs, ("this scene", str(path)))
    if found:
        why = f"only stages after {scene.name_of_stage(index)!r} may differ from the scene that was computed: {found}"
        raise SceneError([Problem("scene", None, found.partition(":")[0], why, "compute the scene from its start instead")])


def last_saved(scene, folder):
    """Origin of the last stage end that all processes of a run directory have saved; raises EnvironmentFailed without one."""
    for index in reversed(range(len(scene.stage))):
        origin = Origin(Path(folder), scene.stage[index].name)
        sessions = {_session(origin.path(name)) for name in processes(scene, index)}
        if len(sessions) == 1 and None not in sessions:
            return origin
    raise exits.EnvironmentFailed(f"no stage in {folder} ended with checkpoints of all processes: run the scene again")


def _session(path):
    """Session of a checkpoint of a stage's end, or None."""
    from coupler_protocol.files import checkpoint

    about = checkpoint.attributes(path) if path.is_file() else {}
    return about["session"] if about.get("phase") == END else None


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
