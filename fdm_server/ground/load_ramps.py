"""Forces that change over the steps of a stage: unloading by an excavation, pressure on the ground surface.

The reaction R of removed zones on the remaining gridpoints (stresses and weight) replaces the zones and is reduced gradually; a
pressure p grows in the same way. With the share s of the ramp, from 0 to 1 (load_steps.py), the applied forces are

    (1 - s) R          or          -s p n dA                in addition to earlier applied forces.

Both keep their direction and their size when the surface moves. Pressure on a part xi_0..xi_1 of a side of length l acts on its
two ends with p l (d - m) and p l m, with d = xi_1 - xi_0, m = (xi_1^2 - xi_0^2)/2.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdm_server.ground.load_steps import Ramp
from fdm_server.ground.removed_zones import cut_window
from fdm_server.mesh.grid_sides import surface_edges
from fdm_server.step import present_shape

FLAT = 1e-12  # largest inclination, over its length, of a side that counts as normal to an axis


class ForceRamp(NamedTuple):
    """Applied forces of n gridpoints, from `start` to `end` [N] with the share of a ramp."""

    nodes: NDArray[np.int64]  # (n,)
    start: NDArray[np.float64]  # (n,2)
    end: NDArray[np.float64]  # (n,2)
    ramp: Ramp

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


def forces_of_even_loads(xy, edges, push, x=None, y=None):
    """Forces (N,2) [N] at gridpoints xy (N,2) of loads `push` (E,2) [N], uniform over the parts of sides (E,2) within x, y."""
    a, b = xy[edges[:, 0]], xy[edges[:, 1]]
    along = b - a
    first, last = np.zeros(len(edges)), np.ones(len(edges))
    for axis, span in enumerate((x, y)):
        if span is None:
            continue
        flat = np.abs(along[:, axis]) <= FLAT * np.abs(along).max(axis=1)
        way = np.where(flat, 1.0, along[:, axis])
        low, high = (span[0] - a[:, axis]) / way, (span[1] - a[:, axis]) / way
        inside = (a[:, axis] >= span[0]) & (a[:, axis] <= span[1])
        first = np.where(flat, np.where(inside, first, 1.0), np.maximum(first, np.clip(np.minimum(low, high), 0.0, 1.0)))
        last = np.where(flat, last, np.minimum(last, np.clip(np.maximum(low, high), 0.0, 1.0)))
    part, moment = np.maximum(last - first, 0.0), np.where(last > first, 0.5 * (last**2 - first**2), 0.0)
    force = np.zeros_like(xy)
    np.add.at(force, edges[:, 0], push * (part - moment)[:, None])
    np.add.at(force, edges[:, 1], push * moment[:, None])
    return force
