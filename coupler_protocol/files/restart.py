"""Checkpoints that a run can continue from, and whether they belong to the scene and to each other.

A checkpoint `NAME.STAGE.h5` of a run directory holds the State of one side at the end of a stage, `NAME.STAGE@STEP.h5` inside of
one. As attributes it carries what it belongs to: version, process, step, stage, phase, the resolved scene, and the session in
which both sides computed it: checkpoints of equal session, stage and step are of the same moment (saved_moments.py).

A damaged checkpoint is refused by its name (seal.py), and so is a State that no step can be taken with (`prove` of each side).
"""

import hashlib
import json
import logging
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

from coupler_protocol import exits
from coupler_protocol.files.proof import require
from coupler_protocol.files.undo_log import roll_back
from coupler_protocol.problems import Problem, SceneError
from coupler_protocol.scene import run_number
from coupler_protocol.scene.differences import differences
from coupler_protocol.scene.named_files import that_computes
from coupler_protocol.scene.stage_kinds import number_of

SCENE, RUN = "scene_identity", "run"  # attributes of files for frames
MOST_TOLD = 8  # differences of two scenes that are named
log = logging.getLogger(__name__)
FUNCTIONS = "functions"  # name of a plugin that was made from functions, not a file
FREE = ("title", "units", "record", "measure", "link", "fos")  # keys of a scene by which no State differs
OF_DISCS = ("seed", "discs", "stones")  # keys by which no State differs before discs fill the windows, in [[window]] too
END, INSIDE = "end of step", "inside of the stage"  # phases of a State from which steps can go on; others are for inspection


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

    @property
    def inside(self):
        """Whether the checkpoint is from the inside of its stage, else from its end."""
        return self.about["phase"] == INSIDE

    def is_of(self, folder):
        """Whether the checkpoint is in this folder: an earlier attempt at the same run wrote it."""
        return self.path.parent.resolve() == Path(folder).resolve()

    def said(self, name, kind):
        """The attribute `name`, which went in as JSON; raises proof.UnprovenError where it is missing or of another kind."""
        value = json.loads(self.about.get(name, "null"))
        require(isinstance(value, kind), f"its attribute {name} is missing or of another kind")
        return value


def attributes(scene, process, stage, phase, step, session, factor, run, **more):
    """Attributes of a checkpoint of the process of this name.

    factor: of gravity; run: number of the run; `more` goes in as JSON.
    """
    named = {"process": process, "stage": stage, "phase": phase, "step": step, "session": session, "gravity_factor": factor}
    named["run"] = run_number.as_text(run)
    named["version"] = version("colluvium")
    return named | {key: json.dumps(value) for key, value in {"scene": scene.resolved(), **more}.items()}


def named(plugin):
    """Attribute that names the functions of a user with which a State was computed."""
    return {} if plugin is None else {"plugin": plugin.name}


def check_plugin(about, path, plugin):
    """Raises EnvironmentFailed where a run that was computed with a file of functions would go on without any.

    about: attributes of the checkpoint at `path`. Functions that were given from Python have no name to ask for: that they are
    missing only goes into the log.
    """
    found = about.get("plugin")
    name = json.loads(found) if found else None
    if name is None or plugin is not None:
        return
    if name != FUNCTIONS:
        raise exits.EnvironmentFailed(f"{path} was computed with the plugin {name}: give it again (--plugin {name})")
    log.warning("%s was computed with on_stage or on_step, the run goes on without them", path)


def index_of(scene, origin):
    """Number of the stage to go on from; raises EnvironmentFailed where the scene has no such stage, or none after it."""
    names = [stage.name for stage in scene.stage]
    if origin.stage not in names:
        raise exits.EnvironmentFailed(f"{origin}: the scene has no stage {origin.stage!r}; it has {', '.join(names)}")
    if origin.stage == names[-1]:
        raise exits.EnvironmentFailed(f"{origin}: this is the last stage: nothing remains to be computed")
    return names.index(origin.stage)


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

    Raises EnvironmentFailed where there is none or where it is damaged, SceneError naming the keys that differ.
    """
    index, path = index_of(scene, origin), origin.path(name)
    if not path.is_file():
        raise exits.EnvironmentFailed(f"{path} does not exist: the end of this stage was not saved")
    found = read(scene, path, name, index)
    if found.inside or found.about["stage"] != origin.stage:
        raise exits.EnvironmentFailed(f"{path} is not the checkpoint of the end of stage {origin.stage!r}: files were exchanged")
    check_scene(scene, json.loads(found.about["scene"]), index, path)
    return found


def read(scene, path, name, index):
    """The checkpoint of the process `name` at `path`, as Saved; index: number of its stage.

    Raises EnvironmentFailed where it is damaged, or of another process, stage or version.
    """
    from coupler_protocol.files import checkpoint

    try:
        fields, about = checkpoint.load(path)
    except checkpoint.DamagedError as error:
        raise exits.EnvironmentFailed(f"{error}. {instead_of(scene, path.parent, index)}") from error
    check_about(scene, about, path, name, index)
    return Saved(index, fields, about, path)


def check_about(scene, about, path, name, index):
    """Raises EnvironmentFailed unless these attributes of the file at `path` are those of a checkpoint to continue from."""
    if about.get("phase") not in (END, INSIDE):
        raise exits.EnvironmentFailed(f"{path} is not a checkpoint of the end of a stage")
    missing = [key for key in ("version", "process", "stage", "step", "session", "scene", "gravity_factor") if key not in about]
    if missing:
        raise exits.EnvironmentFailed(f"{path} is not a checkpoint of the end of a stage: it has no {', '.join(missing)}")
    if about["version"] != version("colluvium"):
        raise exits.EnvironmentFailed(f"{path} was written by version {about['version']}, this is {version('colluvium')}")
    if (about["process"], about["stage"]) != (name, scene.name_of_stage(index)):
        of = f"of {about['process']} at the end of stage {about['stage']!r}"
        raise exits.EnvironmentFailed(f"{path} is a checkpoint {of}: files were exchanged or renamed")


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
    """Raises SceneError where `scene` differs from the resolved `earlier` in more than FREE and stages after `index`."""
    both = (that_computes(resolved) for resolved in (scene.resolved(), earlier))
    mine, theirs = (_bound(resolved, index, filled(scene, index)) for resolved in both)
    found = list(differences(mine, theirs, ("this scene", str(path))))
    if found:
        if index == len(scene.stage) - 1:
            may = "only record and link may differ from the scene that was computed"
            remedy = "choose another --out or use --force"
        else:
            name = scene.name_of_stage(index)
            also = "" if filled(scene, index) else " discs, stones, seed,"
            may = f"only{also} stages after {name!r}, record and link may differ from the scene that was computed"
            remedy = "compute the scene from its start instead"
        problems = [Problem("scene", None, text.partition(":")[0], f"{may}: {text}", remedy) for text in found[:MOST_TOLD]]
        raise SceneError(problems)


def _bound(resolved, index, discs=True):
    """What a run that goes on after the stage with number `index` must have in common with the one before.

    discs: whether they exist after the stage.
    """
    stages = [{key: value for key, value in stage.items() if key != "record"} for stage in resolved["stage"][: index + 1]]
    bound = {key: value for key, value in resolved.items() if key not in FREE} | {"stage": stages}
    if not discs:
        bound = _without(OF_DISCS, bound) | {"window": [_without(OF_DISCS, window) for window in resolved.get("window", ())]}
    return bound


def _without(keys, table):
    return {key: value for key, value in table.items() if key not in keys}


def part_file(folder, name):
    """Path of the file for frames of the process `name`: earlier files in the folder stay, and the new one is a further part.

    Earlier files are made what they were at their last fsync if the machine was started again since (undo_log.py).
    """
    first, taken = Path(folder) / f"{name}.vtkhdf", [0]
    roll_back_all(folder, name)
    for path in Path(folder).glob(f"{name}.part*.vtkhdf"):
        number = path.name[len(name) + len(".part") : -len(".vtkhdf")]
        taken += [int(number)] if number.isdecimal() else []
    return first if not first.exists() and taken == [0] else first.with_name(f"{name}.part{max(taken) + 1}.vtkhdf")


def roll_back_all(folder, name):
    """Makes all files for frames of the process `name` what they were at their last fsync, and logs it (undo_log.py)."""
    for path in (Path(folder) / f"{name}.vtkhdf", *sorted(Path(folder).glob(f"{name}.part*.vtkhdf"))):
        if done := roll_back(path):
            log.warning("%s", done)


def kept(scene, saved, path, run):
    """Attributes of the file for frames at `path`: its scene and run, and the results in earlier files that count.

    saved: the checkpoint from which the run continues, or None; run: number of the run.
    """
    about = {SCENE: identity(scene), RUN: run_number.as_text(run)}
    if saved is None:
        return about | ({"kept_stages": []} if ".part" in path.name else {})
    if saved.inside:
        return about | {"kept_step": saved.about["step"]}
    return about | {"kept_stages": [stage.name for stage in scene.stage[: saved.index + 1]]}


def identity(scene, index=None):
    """Hash of all of a scene by which States differ, at the end of the stage with this number (None: of the run)."""
    bound = _bound(
        that_computes(scene.resolved()), *((len(scene.stage) - 1,) if index is None else (index, filled(scene, index)))
    )
    return hashlib.blake2b(json.dumps(bound, sort_keys=True).encode(), digest_size=16).hexdigest()


def begins_after(saved):
    """Row of run.json about the checkpoint that a run continues from."""
    about = {"run": str(saved.path.parent), "stage": saved.about["stage"]}
    return {"begins_after": about | ({"step": saved.about["step"]} if saved.inside else {})}
