"""The Python interface: `colluvium.Scene.read(path)`, `colluvium.run(scene, out=...)`, `colluvium.resume(run_dir)`."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coupler_protocol import exits
from coupler_protocol.files import checkpoint, locks, restart, run_json, saved_moments
from coupler_protocol.process import command_line
from coupler_protocol.process.plugin import from_functions
from coupler_protocol.scene.reader import build_scene, read_scene

if TYPE_CHECKING:
    from colluvium.results.run import Run


class Scene:
    """Scenes: `Scene.read(path)` from a file, `Scene(format=1, seed=1, ...)` from tables given as keywords."""

    def __new__(cls, **tables: Any) -> Any:
        """Makes a scene from tables; raises coupler_protocol.problems.SceneError with all its problems."""
        return build_scene(tables)

    @staticmethod
    def read(path: str | Path, overrides: Sequence[str] = ()) -> Any:
        """Reads the scene of a TOML file; raises coupler_protocol.problems.SceneError with all its problems."""
        return read_scene(path, overrides)


def run(
    scene: Any,
    out: str | Path,
    in_process: bool = True,
    force: bool = False,
    report: Any = "none",
    *,
    on_stage: Callable[[Any], None] | None = None,
    on_step: tuple[int, Callable[[Any], None]] | None = None,
) -> "Run":
    """Computes `scene` into the folder `out` and returns its results (`colluvium.open_run`).

    scene: a Scene, a dictionary of its tables, or the path of a file; copies with other values are checked like a file.
    in_process: both sides in threads of this process; otherwise one process each, bit-identical.
    on_stage: function that is called at the end of each stage, on_step: (n, function) for every n steps, with a
    coupler_protocol.process.plugin.Moment of the side; the run continues with its changes. In one process only.
    Raises a coupler_protocol.exits.RunEnded with the reason and whose fault it is.
    """
    from colluvium.results.run import open_run
    from colluvium.running import processes, threads

    plugin = _functions(on_stage, on_step, in_process)
    scene = _checked(scene)
    out = command_line.make_folder(out)
    with locks.held(out, [processes.LOCK]):
        locks.refuse_all(out, [processes.LOCK])
        command_line.prepare_folder(out, processes.own_files(out), force, command_line.inputs_of(scene))
        if in_process:
            threads.run(scene, out, report=report, plugin=plugin)
        else:
            processes.run_scene(scene, out, report)
    return open_run(out)


def _checked(scene: Any) -> Any:
    """The scene of a path, of a dictionary, or of a Scene (whose `model_copy` does not check values); raises SceneError."""
    if isinstance(scene, str | Path):
        return read_scene(scene)
    return build_scene(scene if isinstance(scene, Mapping) else scene.model_dump(mode="json", warnings=False))


def resume(
    run_dir: str | Path, in_process: bool = True, report: Any = "none", *, on_stage: Any = None, on_step: Any = None
) -> "Run":
    """Continues the run in `run_dir` from its last checkpoint that all processes have; returns its results.

    on_stage, on_step: as in `run`; give those of the run again. Raises a coupler_protocol.exits.RunEnded with the reason:
    FinishedBefore if nothing remains to be computed, EnvironmentFailed if the run had a plugin file and now has none.
    """
    from colluvium.results.run import open_run
    from colluvium.running import processes, threads

    out = Path(run_dir)
    plugin = _functions(on_stage, on_step, in_process)
    with locks.held(out, [processes.LOCK]):
        scene = to_go_on(out, plugin)[0]
        if in_process:
            threads.run(scene, out, report=report, plugin=plugin)
        else:
            quiet = ["--quiet"] if report == "none" else []
            processes.checked(processes.run_files(out / "scene.json", out, processes.windows_of(scene), quiet))
    return open_run(out)


def _functions(on_stage: Any, on_step: Any, in_process: bool) -> Any:
    """The Plugin of these functions, or None; raises ValueError for functions without `in_process`."""
    plugin = from_functions(on_stage, on_step)
    if plugin is not None and not in_process:
        raise ValueError("functions cannot be called in other processes: run in_process, or give the servers --plugin FILE")
    return plugin


def to_go_on(out: Path, plugin: Any = None, scene: Any = None) -> tuple[Any, str]:
    """Scene of the run in the folder `out` (default: that of scene.json), and where it continues, in words.

    Raises FinishedBefore if nothing remains to be computed, EnvironmentFailed if the run had a plugin and `plugin` is None.
    """
    if scene is None:
        if not (out / "scene.json").exists():
            raise exits.EnvironmentFailed(f"{out} has no scene.json: it is not the folder of a run, or the run never began")
        scene = read_scene(out / "scene.json")
    if (out / run_json.NAME).exists():
        run_json.read(out / run_json.NAME)  # a damaged one is refused before anything is written
    conductor = "fdm.rank0" if scene.grid else "dem.rank1"
    if sentence := saved_moments.finished(scene, out, conductor, True):
        raise exits.FinishedBefore(sentence)
    saved_moments.refuse_other_scene(scene, out, conductor)
    (out / "endpoint").unlink(missing_ok=True)  # of a process that was killed
    path, where = saved_moments.common_in_folder(scene, out)
    if path is not None:
        restart.check_plugin(checkpoint.attributes(path), path, plugin)
    return scene, where
