"""Checkpoints of the continuum at the end of a stage and inside of one, and how it continues from them.

A checkpoint contains the State of the grid, the active zones, from which the model is built, and for each rim the reaction of its
removed zones. Inside of a stage it also contains what the objects of the stage give (StageRun.saved).
"""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from coupler_protocol.files import checkpoint, proof, restart, saved_moments
from coupler_protocol.scene.changes import after_stage, in_stage
from coupler_protocol.scene.schedule import acting_boundaries
from fdm_server.effects import with_damping
from fdm_server.mesh.grid_sides import fixed_components
from fdm_server.model import State, build_model, model_of
from fdm_server.procedure.proof import prove, prove_rims, prove_zones

NAME = "fdm.rank0"


class RimState(NamedTuple):
    """Reaction of the removed zones inside a rim of K gridpoints, and the forces of its discs."""

    reaction: NDArray[np.float64]  # (K,2) [N] without weight
    reaction_mass: NDArray[np.float64]  # (K,) [kg]
    force: NDArray[np.float64]  # (K,2) [N] of the last step


class GridState(NamedTuple):
    """Everything that changes on the continuum's side."""

    zone: NDArray[np.int64]  # (A,) active zones
    grid: State
    rims: dict[str, RimState]  # by the name of the window
    stage: dict[str, Any]  # inside of a stage: what StageRun.saved gives


def save(side, stage, phase, factor):
    """Writes the checkpoint of a stage of a fdm_server.procedure.grid_side.ContinuumSide; returns its path."""
    inside = side.stage.saved() if phase == restart.INSIDE else {}
    path = saved_moments.path_of(side.out, NAME, stage, side.steps if inside else 0)
    rims = {rim.window.name: RimState(rim.reaction, rim.reaction_mass, rim.force) for rim in side.rims}
    more = {"rows": side.rows(), "gravity": side.gravity, "time": side.time, "warnings": side.warnings}
    more |= {"reports": {rim.window.name: rim.report for rim in side.rims}} | restart.named(side.plugin)
    about = restart.attributes(side.scene, NAME, stage, phase, side.steps, side.session, factor, side.run_number, **more)
    checkpoint.save(path, GridState(side.model.zone, side.state, rims, inside), about)
    return path


def model_at(scene, grid, zone, index):
    """Model of the active zones `zone` (A,), with materials and held sides as at the end of the stage with number `index`."""
    return _model_of(after_stage(scene, index), scene, grid, zone, index)


def model_inside(scene, grid, zone, index, step_factor):
    """The model as inside of the stage with number `index`, with its damping; step_factor: of the model, None in static mode."""
    now = in_stage(scene, index)
    damping = now.damping if scene.stage[index].damping is None else scene.stage[index].damping
    model = _model_of(now, scene, grid, zone, index)
    return replace(model, law=with_damping(model.law, damping), step_factor=step_factor)


def _model_of(now, scene, grid, zone, index):
    whole = build_model(now, grid)
    fixed = fixed_components(grid, acting_boundaries(scene, index))
    return model_of(grid, zone, whole.density, whole.material_law, fixed)


def restore(side, saved):
    """Restores a new side from a checkpoint (coupler_protocol.files.restart.Saved).

    Raises EnvironmentFailed if no step can be taken with what was saved.
    """
    with proof.of_file(saved.path):
        found = checkpoint.rebuild(GridState, saved.fields)
        prove_zones(found.zone, len(side.grid.zones))
        if saved.inside:
            proof.require("step_factor" in found.stage, "state.stage.step_factor is missing")
            model = model_inside(side.scene, side.grid, found.zone, saved.index, found.stage["step_factor"])
        else:
            model = model_at(side.scene, side.grid, found.zone, saved.index)
        prove(model, found.grid)
        prove_rims(side.rims, found.rims)
        side.earlier = saved.said("rows", list)
        side.warnings = saved.said("warnings", list)
        side.time = saved.said("time", float | int)
        side.gravity = tuple(saved.said("gravity", list))
        proof.require(len(side.gravity) == 2, "its attribute gravity is not a pair")
        reports = saved.said("reports", dict)
    side.model, side.state = model, found.grid
    for rim in side.rims:
        rim.reaction, rim.reaction_mass, rim.force[:] = found.rims[rim.window.name]
        rim.report = reports.get(rim.window.name, {})
    side.steps = saved.about["step"]
    side.coupled = restart.coupled(side.scene, saved.index)
    side.inside = found.stage or None
