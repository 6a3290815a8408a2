"""What loads the ground of a search: gravity, surcharges and loads of boundaries in full; sides that are driven hold.

All stages of a scene count, whatever their order: the ground is searched as it is after the last of them, but for overload.
"""

import numpy as np

from coupler_protocol.scene.schedule import acting_boundaries, plan
from fdm_server.ground.boundaries_in_time import load_forces
from fdm_server.ground.load_ramps import surcharge_ramp


def gravity_of(scene):
    """Gravity [m/s2] of the first stage that has any, before a ramp changes it; 0 where no stage has."""
    legs = (leg.gravity * (leg.start if leg.over else leg.end) for leg in plan(scene))
    return next((gravity for gravity in legs if gravity > 0.0), 0.0)


def boundaries(scene):
    """The boundaries that act in the last stage."""
    return acting_boundaries(scene, len(scene.stage) - 1)


def loads(scene):
    """Loads of boundaries, the last one at each place, and surcharges."""
    at = {boundary.place: boundary for boundary in boundaries(scene) if boundary.loads}
    return list(at.values()), [stage.surcharge for stage in scene.stage if stage.surcharge is not None]


def apply_loads(scene, model, state):
    """Put all loads upon the ground, in full."""
    at_sides, surcharges = loads(scene)
    for boundary in at_sides:
        state.applied += load_forces(model, state, boundary)
    for surcharge in surcharges:
        ramp = surcharge_ramp(model, state, surcharge)
        state.applied[ramp.nodes] = ramp.end


def driven(scene):
    """Names of the boundaries that move sides and here hold them."""
    return [b.label for b in boundaries(scene) if b.velocity is not None and np.any([b.velocity.x, b.velocity.y])]
