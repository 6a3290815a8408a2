"""Scenes computed by the product in this process: the same tables, stages and files as `colluvium run`."""

import tempfile
from pathlib import Path

from colluvium import Scene
from coupler_protocol.interrupt import StopRequest
from coupler_protocol.lockstep import Clocks, Hub
from coupler_protocol.progress import Progress
from fdm_server.stages import ContinuumSide

IDLE = [{"name": "load", "kind": "overload", "until": {"steps": 1}}]  # for scenes of which only the model is used


def tables(grid, material, stage, boundary=None, **more):
    """Tables of a scene without windows; boundary {side: "x" | "y" | "xy"}, more: other tables."""
    held = [{"on": side, "fix": fix} for side, fix in (boundary or {}).items()]
    quiet = {"every": 10**9, "history": 50}  # steps between looks at the ratio
    plain = {"format": 1, "seed": 1, "damping": {"local": 0.8}, "record": quiet}
    materials = material if isinstance(material, list) else [material]
    return plain | {"grid": grid, "material": materials, "boundary": held, "stage": stage} | more


def material(bulk, shear, density=2000.0, **laws):
    """A material; laws: tables of effects by name."""
    return {"name": "ground", "density": density, "elastic": {"bulk": bulk, "shear": shear}} | laws


def compute(scene):
    """Compute all stages of the scene's tables; returns the continuum's side with .model, .state, .results."""
    scene = Scene(**scene)
    with tempfile.TemporaryDirectory() as folder:
        side = ContinuumSide(scene, Hub(None, [], Clocks(scene.link), StopRequest()), Path(folder), Progress(0, "none"))
        side.run()
    return side
