"""Scenes of discs alone, computed in this process: the same tables, stages and files as `colluvium run`."""

import tempfile
from contextlib import contextmanager
from pathlib import Path

from colluvium import open_run
from coupler_protocol.process.interrupt import StopRequest
from coupler_protocol.process.progress import Progress
from coupler_protocol.process.server import RunContext
from coupler_protocol.scene.reader import build_scene
from dem_server.procedure.discs_alone import DiscsAlone, compute

SOIL = {"density": 2000.0, "spring": {"normal": 5.0e7, "shear": 2.0e7}, "friction": {"coefficient": 0.55}}


def tables(stages, discs, every=500, **more):
    """Tables of a scene: stages after the first one, keys of `discs` beside radius and soil, frames `every` so many steps."""
    record = {"every": every, "history": 20}
    discs = {"radius": 0.05, "confinement": 5e3, "soil": SOIL} | discs
    return {"format": 1, "seed": 3, "record": record, "discs": discs, "stage": [{"name": "fill"}, *stages]} | more


def disc_file(folder, rows, head="x,y,radius,vx,vy,spin"):
    """Write a CSV file of discs into the folder; returns its path."""
    path = Path(folder) / "discs.csv"
    path.write_text("\n".join([head, *(",".join(map(repr, map(float, row))) for row in rows)]) + "\n", encoding="utf-8")
    return str(path)


@contextmanager
def of_file(rows, head, stages, discs, plugin=None, **more):
    """The finished run, open, of a scene whose discs come from a file of these rows."""
    with (
        tempfile.TemporaryDirectory() as folder,
        of_tables(tables(stages, discs | {"file": disc_file(folder, rows, head)}, **more), plugin) as run,
    ):
        yield run


@contextmanager
def of_tables(scene, plugin=None):
    """The finished run, open, of a scene's tables."""
    with tempfile.TemporaryDirectory() as folder:
        compute(build_scene(scene), RunContext(Path(folder), Progress(1, "none"), StopRequest(), plugin=plugin))
        with open_run(folder) as run:
            yield run


def computed(scene):
    """Model, State and stones of the discs at the end of a scene's tables, and rows of run.json by stage."""
    with tempfile.TemporaryDirectory() as folder:
        side = DiscsAlone(build_scene(scene), folder, Progress(1, "none"), StopRequest())
        side.run()
        return side.model, side.state, side.stones, side.results
