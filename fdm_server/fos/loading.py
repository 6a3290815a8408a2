"""What loads the ground of a search: gravity, surcharges and loads of boundaries in full; sides that are driven hold.

All stages of a scene count, whatever their order: the ground is searched as it is after the last of them, but for overload.
"""

import numpy as np

from coupler_protocol.scene.schedule import acting_boundaries, plan
from coupler_protocol.scene.stage_kinds import of
from fdm_server.ground.boundaries_in_time import load_forces
from fdm_server.ground.load_ramps import pressure_forces
from fdm_server.ground.removed_loads import surcharge_edges
from fdm_server.step import present_shape


def gravity_of(scene):
    """Gravity [m/s2] under which the ground comes to rest: that of the last equilibrium stage, at the end of its ramps.

    Where no equilibrium stage leaves any: of the first other stage that has some, before a ramp from there on changes it, or at
    the end of a ramp from 0. Discarded stages and overload on top of it do not count.
    """
    kept = [(of(stage), leg) for stage, leg in zip(scene.stage, plan(scene), strict=True) if not stage.discard]
    at_rest = [leg.gravity * leg.end for kind, leg in kept if kind.drawn and kind.computes]
    if at_rest and at_rest[-1] > 0.0:
        return at_rest[-1]
    legs = (leg.gravity * (leg.start if leg.over and leg.start > 0.0 else leg.end) for _, leg in kept)
    return next((gravity for gravity in legs if gravity > 0.0), 0.0)


def boundaries(scene):
    """The boundaries that act in the last stage."""
    return acting_boundaries(scene, len(scene.stage) - 1)


def loads(scene):
    """Loads of boundaries, the last one at each place, and surcharges {number of the stage: table}."""
    at = {boundary.place: boundary for boundary in boundaries(scene) if boundary.loads}
    return list(at.values()), {k: stage.surcharge for k, stage in enumerate(scene.stage) if stage.surcharge is not None}


def apply_loads(scene, model, state):
    """Put all loads upon the ground, in full."""
    at_sides, surcharges = loads(scene)
    for boundary in at_sides:
        state.applied += load_forces(model, state, boundary)
    xy = present_shape.present(model, state)
    for k, surcharge in surcharges.items():  # not on the floor of a later excavation
        state.applied += pressure_forces(xy, surcharge_edges(scene, model, k), surcharge)


def driven(scene):
    """Names of the boundaries that move sides and here hold them."""
    return [b.label for b in boundaries(scene) if b.velocity is not None and np.any([b.velocity.x, b.velocity.y])]
