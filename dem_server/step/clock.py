"""Step of the discs in a stage: 1 with scaled masses (static mode), or dt seconds with real masses.

The twin of fdm_server/step/clock.py. Velocities of one mode have no meaning in the other, so a change of mode sets them to zero.

Sub-steps (`coupling.substeps` = n). In real time discs may take n steps of dt / n while the grid takes one of dt. Control discs
move with the constant rim velocity v(t + dt/2); the returned force is that at the end, t + dt, not a mean. Then

    disc   m d2x/dt2 = -k (x - x_rim) - ...,  x_rim straight between t and t + dt        error of order dt^2
    rim    M (v+ - v-) = dt F(t)                                                         as without sub-steps

so the scheme stays of order dt^2, while contacts that open and close are resolved by dt / n. It is not a leap-frog: if omega dt
of a disc's frequency is near pi, the forces on the rim are in phase with its motion and add energy, for every n. A disc and a
node at the limit of the mass rule, dt^2 (m_I / 2 + S_I) = M_I, are stable up to omega dt = 2 (2.44 if the node has the factor
2 in reserve), so with the stable step of the discs tau <= 2 / omega (dem_server/step/masses.py)

    dt <= min(n sf, 1) tau                                                               (1)

so sub-steps cannot make the step longer than the stable step of the discs. `tests/physics/test_substeps.py` has the limits.
"""

from dataclasses import replace

from dem_server.effects.damping import DampingTable
from dem_server.step.cycle import in_real_time, in_static_mode


def begin(model, state, damping, step_factor=None):
    """Returns the model with the local damping of a scene's table; changes the state to its mode.

    step_factor: step over the stable step in real time; None: static mode. Sets State.next_dt.
    """
    table = DampingTable(float(damping.local)) if damping is not None and damping.local else None
    model = replace(model, law=model.law._replace(damping=table))
    return in_static_mode(model, state) if step_factor is None else in_real_time(model, state, step_factor)


def begin_coupled(model, state, discs, stage, changed=False):
    """`begin` for a coupled stage of a scene; a static stage after a static one changes nothing, unless its law has `changed`.

    The damping table of a stage in real time is for grid and discs. If it has no local damping, and in static stages, discs keep
    their own damping.
    """
    if not stage.in_real_time:
        return begin(model, state, discs.damping) if model.in_real_time or changed else model
    own = stage.damping if stage.damping is not None and stage.damping.local is not None else discs.damping
    return begin(model, state, own, stage.step_factor or discs.time_step)


def longest_step(model, state, substeps):
    """Longest step [s] of the grid, Eq (1), in which the discs can take `substeps` steps; 1 in static mode."""
    return state.next_dt if not model.in_real_time else state.next_dt * min(substeps, 1.0 / model.real_time)


def divided(model, state, dt, substeps):
    """Returns the model for `substeps` steps in each agreed step of `dt` [s]; sets State.next_dt."""
    state.next_dt = dt / substeps
    return replace(model, real_time=1.0 / substeps)
