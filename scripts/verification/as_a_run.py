"""Scenes computed by the product in this process: the same tables, stages and files as `colluvium run`."""

import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from colluvium import Scene, open_run
from coupler_protocol.process.interrupt import StopRequest
from coupler_protocol.process.progress import Progress
from coupler_protocol.wire.clocks import Clocks
from coupler_protocol.wire.lockstep import Hub
from fdm_server.model import Model, State
from fdm_server.procedure.grid_side import ContinuumSide

IDLE = [{"name": "load", "until": {"steps": 1}}]  # for scenes of which only the model is used
LOOK = 50  # steps between points of the histories and looks at the ratio


class Computed(NamedTuple):
    """What a scene came to: the grid's Model and State, rows of run.json by stage, histories that were asked for, warnings."""

    model: Model
    state: State
    stages: list[dict]
    histories: dict[str, NDArray[np.float64]]
    warnings: list[dict]


def tables(grid, material, stage, boundary=None, **more):
    """Tables of a scene without windows; boundary: {side: "x" | "y" | "xy"} or a list of tables, more: other tables."""
    held = [{"on": side, "fix": fix} for side, fix in boundary.items()] if isinstance(boundary, dict) else boundary or []
    quiet = {"every": 10**9, "history": LOOK}
    plain = {"format": 1, "seed": 1, "damping": {"local": 0.8}, "record": quiet}
    materials = material if isinstance(material, list) else [material]
    return plain | {"grid": grid, "material": materials, "boundary": held, "stage": stage} | more


def material(bulk, shear, density=2000.0, **laws):
    """A material; laws: tables of effects by name."""
    return {"name": "ground", "density": density, "elastic": {"bulk": bulk, "shear": shear}} | laws


def slowing(boundary, load, steps, until, parts=10):
    """Stages that bring a load on as 1 - (1 - s)^2, s from 0 to 1 in so many steps, by straight lines; then the last one ends.

    boundary: table without its load; load(share): the rest of the table; until: end of the last stage.
    """
    stages = []
    for part in range(1, parts + 1):
        table = boundary | load(1.0 - (1.0 - part / parts) ** 2) | {"over": steps // parts}
        end = until if part == parts else {"steps": steps // parts}
        stages.append({"name": f"load {part}", "kind": "load", "boundary": [table], "until": end})
    return stages


def compute(scene, histories=()):
    """Compute all stages of the scene's tables."""
    scene = Scene(**scene)
    with tempfile.TemporaryDirectory() as folder:
        side = ContinuumSide(scene, Hub(None, [], Clocks(scene.link), StopRequest()), Path(folder), Progress(0, "none"))
        side.run()
        with open_run(folder) as run:
            found = {name: run.history(name)[1] for name in histories}
    return Computed(side.model, side.state, side.results, found, side.warnings)
