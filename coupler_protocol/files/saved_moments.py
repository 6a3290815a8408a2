"""Moments of a run: the checkpoints in a folder, and the newest one that all sides have.

Both sides save at the same steps, but a kill can come between the two writes. So each side keeps its last KEPT checkpoints inside
of a stage, and all stage ends; the sides tell each other which they have (HELLO), and the newest common one counts (WELCOME).
A side never takes a step after an ordered checkpoint before its own file is on the disk, so the lists differ by one at most.
"""

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from coupler_protocol import exits
from coupler_protocol.files import checkpoint, restart, run_json
from coupler_protocol.scene import run_number
from coupler_protocol.scene.moments import Moment, newest_common
from coupler_protocol.scene.tables.stages import STOPPED

KEPT = 2  # checkpoints inside of a stage that stay
_INSIDE = re.compile(r"(?P<stage>.+)@(?P<step>\d+)")


Moments = dict[Moment, Path]  # with the files, the newest first


def path_of(folder: str | Path, name: str, stage: str, step: int = 0) -> Path:
    """Path of a checkpoint of the process `name`; step 0: of the end of the stage."""
    return Path(folder) / (f"{name}.{stage}@{step}.h5" if step else f"{name}.{stage}.h5")


def inside(folder: str | Path, name: str) -> list[Path]:
    """Paths of the checkpoints inside of stages of the process `name`."""
    return [path for path in sorted(Path(folder).glob(f"{name}.*@*.h5")) if _INSIDE.fullmatch(_middle(path, name))]


def _middle(path: Path, name: str) -> str:
    """Stage, with the step of a checkpoint inside of it, in the name of a file."""
    return path.name[len(name) + 1 : -len(".h5")]


def in_folder(scene: Any, folder: str | Path, name: str) -> Moments:
    """Checkpoints of the process `name` in the folder of its own run.

    Raises EnvironmentFailed for one that is damaged or of another version, SceneError where they are of another scene.
    """
    numbers = {stage.name: index for index, stage in enumerate(scene.stage)}
    found: Moments = {}
    for path in sorted(Path(folder).glob(f"{name}.*.h5")):
        middle = _middle(path, name)
        stage, _, step = middle.rpartition("@") if _INSIDE.fullmatch(middle) else (middle, "", "0")
        if stage == STOPPED and not int(step):
            continue
        about = _attributes(scene, path, numbers.get(stage, len(numbers)))
        if about.get("phase") not in (restart.END, restart.INSIDE):
            continue
        if "scene" in about:
            restart.check_scene(scene, json.loads(about["scene"]), len(scene.stage) - 1, path)
        restart.check_about(scene, about, path, name, numbers[stage])
        found[Moment(int(about["session"]), numbers[stage], int(step))] = path
    return newest_first(found)


def _attributes(scene: Any, path: Path, index: int) -> dict[str, Any]:
    try:
        return checkpoint.attributes(path)
    except checkpoint.DamagedError as error:
        raise exits.EnvironmentFailed(f"{error}. {restart.instead_of(scene, path.parent, index)}") from error


def newest_first(found: Moments) -> Moments:
    """The same in order of time."""
    return dict(sorted(found.items(), key=lambda item: item[0].order, reverse=True))


def of_side(scene: Any, folder: str | Path, name: str, origin: restart.Origin | None) -> Moments:
    """Checkpoints from which the process `name` can continue in its folder: its own and the stage end `origin` of another run."""
    if origin is None:
        return in_folder(scene, folder, name)
    index = restart.index_of(scene, origin)
    ends: Moments = {}
    if name in restart.processes(scene, index):
        saved = restart.load(scene, origin, name)
        ends = {Moment(int(saved.about["session"]), index, 0): saved.path}
    return ends if origin.continues(folder) else newest_first(in_folder(scene, folder, name) | ends)


def run_of(folder: str | Path, moments: Moments) -> int:
    """Number of the run in a folder by its newest checkpoint there; without one, a new number."""
    own = (path for path in moments.values() if path.parent.resolve() == Path(folder).resolve())
    newest = next(own, None)
    found = checkpoint.attributes(newest).get(restart.RUN) if newest else None
    return int(found, 16) if found else run_number.new()


def common_in_folder(scene: Any, folder: str | Path) -> tuple[Path | None, str]:
    """Path of the checkpoint of the conducting side from which a run whose sides share a folder continues, and this in words.

    None: from the start.
    """
    names = restart.processes(scene, len(scene.stage) - 1)
    own, *theirs = [in_folder(scene, folder, name) for name in names]
    found = newest_common(own, theirs, lambda moment: restart.filled(scene, moment.stage))
    if found is None:
        return None, "from the start: no checkpoint of all sides is there"
    return own[found], f"{'in' if found.step else 'after'} {found.as_text(scene)}"


def refuse_other_scene(scene: Any, folder: str | Path, name: str) -> None:
    """Raises SceneError or EnvironmentFailed if the folder has results of the process `name` of another scene or version.

    SceneError names the keys that differ; it needs a checkpoint. Files that the machine left half written when it stopped are
    first made what they were at their last fsync.
    """
    import h5py

    in_folder(scene, folder, name)
    restart.roll_back_all(folder, name)
    for path in sorted(Path(folder).glob(f"{name}.*vtkhdf")):
        try:
            with h5py.File(path, "r", locking=False) as file:
                found = file.attrs.get(restart.SCENE)
        except OSError as error:
            raise exits.EnvironmentFailed(
                f"{path} cannot be read: {error}. Move it away to continue the run without its frames, or use --force"
            ) from None
        if found != restart.identity(scene):
            raise exits.EnvironmentFailed(
                f"{folder} holds results already, of another scene or version ({path.name}): choose another --out or use --force"
            )


def finished(scene: Any, folder: str | Path, name: str, conducts: bool) -> str:
    """A sentence if the run in a folder is finished, as far as it concerns the process `name`; else "".

    conducts: whether this process conducts the stages.
    """
    newest = next(iter(in_folder(scene, folder, name)), None)
    if newest is None or not is_last(scene, newest):
        return ""
    path, own = Path(folder) / run_json.NAME, Path(folder) / f"{name}.json"
    found = run_json.read(path) if path.exists() else {}
    if found.get("exit_code") not in (exits.DONE, exits.NOT_AT_REST):
        found = run_json.read(own) if not conducts and own.exists() else {}
    if not found:
        return ""
    return f"the run in {folder} is finished ({found.get('reason')}): nothing remains to be computed; --force computes it again"


def is_last(scene: Any, moment: Moment) -> bool:
    """Whether nothing remains to be computed after a moment."""
    return moment.stage == len(scene.stage) - 1 and not moment.step


def prune(folder: str | Path, name: str, written: Sequence[Path]) -> None:
    """Removes checkpoints inside of stages of the process `name` except the last KEPT of `written`, in the order of writing."""
    for path in set(inside(folder, name)) - set(written[-KEPT:]):
        path.unlink(missing_ok=True)
