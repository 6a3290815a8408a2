"""What a step means to the discs in a stage: a step of 1 with scaled masses (static), or dt seconds with the real ones.

The twin of fdm_server/clock.py: velocities of one mean nothing in the other, discs come to rest where the meaning changes.
"""

from dataclasses import replace

from dem_server.cycle import in_real_time, in_static_mode
from dem_server.effects.damping import DampingTable


def begin(model, state, damping, step_factor=None):
    """The model for steps with the local damping of a scene's table; brings the state to it.

    step_factor: share of the stable step taken in real time; None: static mode. State.next_dt is then the step.
    """
    table = DampingTable(float(damping.local)) if damping is not None and damping.local else None
    model = replace(model, law=model.law._replace(damping=table))
    return in_static_mode(model, state) if step_factor is None else in_real_time(model, state, step_factor)


def begin_coupled(model, state, discs, stage):
    """`begin` for a coupled stage of a scene; a static stage after a static one leaves everything as it is.

    The table of a stage in real time is for grid and discs; where it names no local damping, and in static stages, discs keep
    their own.
    """
    if stage.time != "real":
        return model if model.real_time is None else begin(model, state, discs.damping)
    own = stage.damping if stage.damping is not None and stage.damping.local is not None else discs.damping
    return begin(model, state, own, stage.step_factor or discs.time_step)
