"""What a step means in a stage: a step of 1 with scaled masses on the way to rest (static), or dt seconds with real masses.

The velocities of one mean nothing in the other: they begin at zero where the meaning changes.
"""

from dataclasses import replace

from fdm_server.effects import with_damping
from fdm_server.step import histories
from fdm_server.step.masses import real_step
from fdm_server.step.present_shape import present, renew

STEP_FACTOR = 0.5


def begin(model, state, damping, step_factor=None):
    """The model for steps with the damping of a scene's table; brings the state to it.

    step_factor: share of the stable step taken in real time; None: static mode.
    """
    model = replace(model, law=with_damping(model.law, damping), step_factor=step_factor)
    if model.in_real_time != state.in_real_time:
        state.velocity[:] = 0.0
    state.dt = real_step(present(model, state), model) if model.in_real_time else None
    if state.mass is not None:
        renew(model, state)
    histories.begin_stage(model, state)
    return model


def seconds(state):
    """What a step adds to the time [s]: in static mode 1, which counts steps."""
    return state.dt if state.in_real_time else 1.0
