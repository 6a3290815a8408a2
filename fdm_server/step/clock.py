"""Step of the grid in a stage: 1 with scaled masses (static mode), or dt seconds with real masses.

Velocities of one mode have no meaning in the other: a change of mode sets them to zero.
"""

from dataclasses import replace

from fdm_server.effects import with_damping
from fdm_server.step import histories
from fdm_server.step.masses import real_step
from fdm_server.step.present_shape import present, renew

STEP_FACTOR = 0.5


def begin(model, state, damping, step_factor=None):
    """Returns the model with the damping of a scene's table; changes the state to its mode.

    step_factor: step over the stable step in real time; None: static mode.
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
    """Step [s] in real time; 1 in static mode, where the time counts steps."""
    return state.dt if state.in_real_time else 1.0
