"""Checkpoints of the continuum at the end of a stage, and how it continues from them.

A checkpoint contains the State of the grid, the active zones, from which the model is built, and for each rim the reaction of its
removed zones.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coupler_protocol.files import checkpoint, proof, restart
from coupler_protocol.scene.changes import after_stage
from coupler_protocol.scene.schedule import acting_boundaries
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


def save(side, stage, phase, factor):
    """Writes the checkpoint of a stage of a fdm_server.procedure.grid_side.ContinuumSide; returns its path."""
    path = side.out / f"{NAME}.{stage}.h5"
    rims = {rim.window.name: RimState(rim.reaction, rim.reaction_mass, rim.force) for rim in side.rims}
    more = {"rows": side.rows(), "gravity": side.gravity, "time": side.time, "warnings": side.warnings}
    more |= restart.named(side.plugin)
    about = restart.attributes(side.scene, NAME, stage, phase, side.steps, side.session, factor, **more)
    checkpoint.save(path, GridState(side.model.zone, side.state, rims), about)
    return path


def model_at(scene, grid, zone, index):
    """Model of the active zones `zone` (A,), with materials and held sides as at the end of the stage with number `index`."""
    whole = build_model(after_stage(scene, index), grid)
    fixed = fixed_components(grid, acting_boundaries(scene, index))
    return model_of(grid, zone, whole.density, whole.material_law, fixed)


def restore(side, saved):
    """Restores a new side from a saved stage end (coupler_protocol.files.restart.Saved).

    Raises EnvironmentFailed if no step can be taken with what was saved.
    """
    with proof.of_file(saved.path):
        found = checkpoint.rebuild(GridState, saved.fields)
        prove_zones(found.zone, len(side.grid.zones))
        model = model_at(side.scene, side.grid, found.zone, saved.index)
        prove(model, found.grid)
        prove_rims(side.rims, found.rims)
        side.earlier = saved.said("rows", list)
        side.warnings = saved.said("warnings", list)
        side.time = saved.said("time", float | int)
        side.gravity = tuple(saved.said("gravity", list))
        proof.require(len(side.gravity) == 2, "its attribute gravity is not a pair")
    side.model, side.state = model, found.grid
    for rim in side.rims:
        rim.reaction, rim.reaction_mass, rim.force[:] = found.rims[rim.window.name]
    side.steps = saved.about["step"]
    side.coupled = restart.coupled(side.scene, saved.index)
