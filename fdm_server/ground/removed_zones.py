"""Removal of the zones of a window or an excavation; forces replace their action on the remaining gridpoints."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdm_server.model import carried, model_of
from fdm_server.step.blocks import from_blocks, to_blocks
from fdm_server.step.forces import sum_all
from fdm_server.step.masses import weight_masses
from fdm_server.step.present_shape import renew


class Reaction(NamedTuple):
    """Action of removed zones on the remaining gridpoints."""

    force: NDArray[np.float64]  # (N,2) [N] of their stresses
    mass: NDArray[np.float64]  # (N,) [kg] of the removed zones, on which gravity acted

    def under(self, gravity):
        """Forces (N,2) [N] that replace the removed zones under `gravity` [m/s2]: stresses and weight."""
        total = self.force.copy()
        total[:, 1] -= gravity * self.mass
        return total


def cut_window(model, state, mask):
    """Removes the zones `mask` (Z of the grid,); returns new model, new state, and the Reaction of the removed zones.

    Gridpoints keep their numbers; those without zones are held. Adding `reaction.under(gravity)` to
    `state.applied` keeps the equilibrium of every other gridpoint.
    """
    gone = mask[model.zone]
    if gone.sum() != mask.sum():
        raise ValueError(f"{mask.sum() - gone.sum()} zones of the window have been removed before")
    grid = model.grid
    lost = model.zones[gone]
    new = model_of(grid, model.zone[~gone], model.density, model.material_law, model.fixed)
    new = replace(new, step_factor=model.step_factor)
    attached = np.diff(new.start) > 0

    corner = _rows_of(state.corner_force, model, gone)
    force = np.zeros_like(state.force)
    for axis in range(2):
        pull = corner[:, 4 * axis : 4 * axis + 4]
        force[:, axis] = np.bincount(lost.ravel(), pull.ravel(), minlength=len(grid.xy))
    mass = weight_masses(grid.xy, lost, model.zone_density[gone])
    reaction = Reaction(np.where(attached[:, None], force, 0.0), np.where(attached, mass, 0.0))

    after = carried(state, lambda blocks: to_blocks(_rows_of(blocks, model, ~gone)))
    after.velocity[~attached] = 0.0
    if after.mass is not None:
        renew(new, after)
    sum_all(new, after.corner_force, after.force)
    return new, after, reaction


def _rows_of(blocks, model, chosen):
    """Values by zone of the chosen active zones."""
    return from_blocks(blocks, len(model.zone))[chosen]
