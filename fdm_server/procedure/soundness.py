"""What a State of the grid must be after functions of a user: finite. The message names the place of the first wrong number."""

import numpy as np

from coupler_protocol.exits import PhysicsFailed
from coupler_protocol.geometry import spot
from fdm_server.step.blocks import from_blocks

AT_GRIDPOINTS = {
    "velocity": "velocity",
    "displacement": "displacement",
    "force": "force of zones",
    "applied": "applied force",
    "added_mass": "added mass",
}


def check(moment):
    """Raises PhysicsFailed for numbers of a coupler_protocol.process.plugin.Moment that are NaN or infinite."""
    grid, state = moment.model.grid, moment.state
    for name, meaning in AT_GRIDPOINTS.items():
        wrong = broken(getattr(state, name))
        if len(wrong):
            point = wrong[0]
            raise _failed(moment, meaning, f"gridpoint {point} at {spot(grid.xy[point], grid.origin, 6)}", len(wrong))
    wrong = broken(from_blocks(state.stress, len(moment.model.zone)))
    if len(wrong):
        middle = grid.xy[moment.model.zones[wrong[0]]].mean(axis=0)
        raise _failed(moment, "stress", f"zone {moment.model.zone[wrong[0]]} at {spot(middle, grid.origin, 6)}", len(wrong))


def broken(array):
    """Rows (k,) of an array that have NaN or infinite numbers."""
    return np.flatnonzero(~np.isfinite(array.reshape(len(array), -1)).all(axis=1))


def _failed(moment, what, where, count):
    others = f", and {count - 1} more" if count > 1 else ""
    return PhysicsFailed(f"the {what} of {where}{others} is NaN or infinite after step {moment.step} of stage {moment.stage!r}")
