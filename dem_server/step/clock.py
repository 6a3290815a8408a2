"""What a step means to the discs in a stage: a step of 1 with scaled masses (static), or dt seconds with the real ones.

The twin of fdm_server/step/clock.py: velocities of one mean nothing in the other, discs come to rest where the meaning changes.

Sub-steps (`coupling.substeps` = n). In real time discs may take n steps of dt / n while the grid takes one of dt. Control discs
go straight on with the rim's velocity v(t + dt/2); the force that goes back is that of the end, at t + dt, never a mean. Then

    disc   m d2x/dt2 = -k (x - x_rim) - ...,  x_rim straight between t and t + dt        error of order dt^2
    rim    M (v+ - v-) = dt F(t)                                                         as without sub-steps

so the whole stays of order dt^2, while contacts that open and close are resolved by dt / n. It is no leap-frog any more: where
omega dt of a disc's frequency comes near pi, the forces that the rim is told come in step with its motion and feed it, whatever
n. A disc and a node at the edge of the mass rule, dt^2 (m_I / 2 + S_I) = M_I, are stable up to omega dt = 2 (2.44 where the
node has the factor 2 in reserve), so with the stable step of the discs tau <= 2 / omega (dem_server/step/masses.py)

    dt <= min(n sf, 1) tau                                                               (1)

and sub-steps make steps as long as the discs bear them at all, not longer. `tests/physics/test_substeps.py` has the limits.
"""

from dataclasses import replace

from dem_server.effects.damping import DampingTable
from dem_server.step.cycle import in_real_time, in_static_mode


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
    if not stage.in_real_time:
        return model if not model.in_real_time else begin(model, state, discs.damping)
    own = stage.damping if stage.damping is not None and stage.damping.local is not None else discs.damping
    return begin(model, state, own, stage.step_factor or discs.time_step)


def longest_step(model, state, substeps):
    """Eq (1): the longest step [s] of the grid in which the discs can take `substeps` of theirs; 1 in static mode."""
    return state.next_dt if not model.in_real_time else state.next_dt * min(substeps, 1.0 / model.real_time)


def divided(model, state, dt, substeps):
    """The model for `substeps` steps in each of the agreed steps of `dt` [s], of which a whole stable one is the limit."""
    state.next_dt = dt / substeps
    return replace(model, real_time=1.0 / substeps)
