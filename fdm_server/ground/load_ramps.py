"""Forces that change over the steps of a stage: unloading by an excavation, pressure on the ground surface.

The reaction R of removed zones on the remaining gridpoints (stresses and weight) replaces the zones and is reduced gradually; a
pressure p grows in the same way. With the share s of the ramp, from 0 to 1 (load_steps.py), the applied forces are

    (1 - s) R          or          -s p n dA                in addition to earlier applied forces.

Both keep their direction and their size when the surface moves (even_loads.py has the forces of a pressure).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdm_server.ground.even_loads import forces_of_even_loads
from fdm_server.ground.load_steps import Ramp
from fdm_server.ground.removed_zones import cut_window
from fdm_server.mesh.grid_sides import surface_edges
from fdm_server.step import present_shape


class ForceRamp(NamedTuple):
    """Applied forces of n gridpoints, from `start` to `end` [N] with the share of a ramp."""

    nodes: NDArray[np.int64]  # (n,)
    start: NDArray[np.float64]  # (n,2)
    end: NDArray[np.float64]  # (n,2)
    ramp: Ramp

    def saved(self):
        """All of it, for a checkpoint inside of the stage."""
        return self._asdict() | {"ramp": self.ramp.saved()}

    @classmethod
    def of(cls, saved):
        """The ForceRamp that `saved` describes."""
        return cls(**(saved | {"ramp": Ramp.of(saved["ramp"])}))

    def begin(self, state):
        """Sets the forces with which the ramp begins."""
        state.applied[self.nodes] = self.start

    def apply(self, state):
        """Sets the forces of the coming step, if they change."""
        if self.ramp.moves:
            state.applied[self.nodes] = self.ramp.between(self.start, self.end)


def remove_zones(model, state, mask, gravity, ramp, loads_on=None):
    """Removes the zones `mask` (Z of the grid,); returns new model, new state, and the ForceRamp that unloads the ground.

    loads_on(new model, old state): the RemovedLoads on the removed zones (removed_loads.py); they end with the ramp.
    """
    old = state
    model, state, reaction = cut_window(model, state, mask)
    force, gone = reaction.under(gravity), np.zeros_like(state.applied)
    if loads_on is not None:
        of_place, gone = loads_on(model, old)
        for place, share in of_place.items():
            state.loads[place] = state.loads[place] - share
    nodes = np.flatnonzero(np.any((force != 0.0) | (gone != 0.0), axis=1))
    before = state.applied[nodes]
    return model, state, ForceRamp(nodes, before + force[nodes], before - gone[nodes], ramp)


def surcharge_ramp(model, state, surcharge, rims=(), ramp=None):
    """ForceRamp that loads the ground surface with `surcharge` (table of a scene), at once without a `ramp`.

    rims: gridpoints of the windows' rims.
    """
    force = pressure_forces(present_shape.present(model, state), surface_edges(model.grid, model.zones, rims), surcharge)
    nodes = np.flatnonzero(np.any(force != 0.0, axis=1))
    before = state.applied[nodes]
    return ForceRamp(nodes, before, before + force[nodes], ramp or Ramp(1))


def pressure_forces(xy, edges, surcharge):
    """Forces (N,2) [N] of the pressure on those sides `edges` (E,2), ground on their left, that face upwards."""
    along = xy[edges[:, 1]] - xy[edges[:, 0]]
    upward = along[:, 0] < 0.0  # ground on the left of a side that runs to the left
    along = along[upward]
    push = surcharge.pressure * np.column_stack([-along[:, 1], along[:, 0]])  # -p n l
    return forces_of_even_loads(xy, edges[upward], push, surcharge.x)
