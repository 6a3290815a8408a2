"""Loads on the ground that an excavation takes away: they leave with it.

A load on a side of removed zones acts on gridpoints that may also belong to zones that remain, at the edge of the excavation. Its
share there ends with the relief, as the reaction of the removed zones does; loads on sides that remain keep theirs.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coupler_protocol.scene.schedule import acting_boundaries
from fdm_server.ground.boundaries_in_time import load_forces
from fdm_server.ground.load_ramps import pressure_forces
from fdm_server.mesh.grid import chosen_zones
from fdm_server.mesh.grid_sides import surface_edges
from fdm_server.mesh.zone_sides import boundary_edges
from fdm_server.step import present_shape


class RemovedLoads(NamedTuple):
    """Forces on the sides of removed zones: of each place in `State.loads`, and of all of them and the surcharges together."""

    of_place: dict[str, NDArray[np.float64]]  # (N,2) [N]
    total: NDArray[np.float64]  # (N,2) [N]


def removed_loads(scene, index, before, after, state):
    """RemovedLoads of the excavation stage with number `index`; before, after: models; state: of the model before."""
    total, of_place = np.zeros_like(state.applied), {}
    own = scene.stage[index].boundary  # of this stage: they act on the ground that is left
    acting = {b.place: b for b in acting_boundaries(scene, index) if b.loads and b.place in state.loads and b not in own}
    for place, boundary in acting.items():
        whole = load_forces(before, state, boundary)
        gone = _share(state.loads[place], whole) * (whole - load_forces(after, state, boundary))
        if np.any(gone):
            of_place[place] = gone
            total += gone
    xy = present_shape.present(before, state)
    for k, stage in enumerate(scene.stage[:index]):
        if stage.surcharge is not None:
            there, left = (surcharge_edges(scene, model, k) for model in (before, after))
            total += pressure_forces(xy, there, stage.surcharge) - pressure_forces(xy, left, stage.surcharge)
    return RemovedLoads(of_place, total)


def _share(acts, whole):
    """How much of the load `whole` (N,2) acts: of a load that did not come to its end, a part."""
    return float((acts * whole).sum() / max((whole * whole).sum(), 1e-300))


def surcharge_edges(scene, model, index):
    """Sides (E,2) of zones on which the surcharge of a stage acts: of the surface before that stage, those that are left."""
    there = np.ones(len(model.grid.zones), dtype=np.bool_)
    for stage in scene.stage[:index]:
        if stage.excavate is not None:
            there &= ~chosen_zones(model.grid, stage.excavate)
    surface = surface_edges(model.grid, model.grid.zones[there])
    left = {tuple(edge) for edge in boundary_edges(model.zones).tolist()}
    return surface[[tuple(edge) in left for edge in surface.tolist()]]
