"""The Python interface: `colluvium.Scene.read(path)` and `colluvium.run(scene, out=...)`."""

from pathlib import Path

from coupler_protocol import program
from coupler_protocol.scene_reader import build_scene, read_scene


class Scene:
    """Makes scenes: `Scene.read(path)` from a file, `Scene(format=1, seed=1, ...)` from tables given as keywords."""

    def __new__(cls, **tables):
        return build_scene(tables)

    @staticmethod
    def read(path, overrides=()):
        """The scene of a TOML file; raises coupler_protocol.problems.SceneError with every problem in it."""
        return read_scene(path, overrides)


def run(scene, out, in_process=True, force=False, report="none"):
    """Compute `scene` into the folder `out` and return its results (`colluvium.open_run`).

    in_process: both sides in threads of this process; otherwise one process each, bit-identical.
    Raises a coupler_protocol.exits.RunEnded that says what went wrong and whose fault it is.
    """
    from colluvium import inprocess, launch
    from colluvium.results import open_run

    out = program.prepare_folder(out, launch.own_files(out), force)
    if in_process:
        inprocess.run(scene, out, report=report)
    else:
        launch.run_scene(scene, Path(out), report)
    return open_run(out)
