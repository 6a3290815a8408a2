"""Present positions of gridpoints, and the masses of the present shape. In small strain the shape is constant.

In large strain the position of a gridpoint is that of the grid plus its displacement. Static masses follow the shape: they are
recomputed every `MASS_STEPS` steps. They have a factor 2 in reserve, of which damping needs 1 + alpha; the remainder (11 % at
alpha = 0.8) is enough for zones that change by half a percent in each of these steps. In real time masses are real, and the step
follows the shape: at the same intervals it is shortened if zones have become thinner.
"""

from fdm_server.step.masses import real_step, static_masses

MASS_STEPS = 20


def begin_large_strain(model, state):
    """Begins large strain: zones follow their gridpoints from now on; does nothing in large strain."""
    if state.mass is None:
        renew(model, state)


def moving(model, state):
    """Positions (N,2) [m] from which displacements count in large strain; None in small strain."""
    return None if state.mass is None else model.grid.xy


def present(model, state):
    """Positions (N,2) [m] of the gridpoints in the present shape of zones."""
    return model.grid.xy if state.mass is None else model.grid.xy + state.displacement


def masses(model, state):
    """Masses (N,) [kg] of the gridpoints: scaled for a step of 1 in static mode, or real in real time."""
    if state.in_real_time:
        return model.weight_mass
    return model.mass if state.mass is None else state.mass


def static_mass(model, state):
    """Masses (N,) [kg] of the gridpoints for a step of 1, in both modes."""
    return model.mass if state.mass is None else state.mass


def count_steps(model, state, steps=1):
    """Counts steps of large strain; recomputes masses or the step after MASS_STEPS steps."""
    state.mass_age += steps
    if state.mass_age >= MASS_STEPS:
        renew(model, state)


def renew(model, state):
    """Recomputes static masses, or shortens the step in real time, for the present shape in large strain."""
    xy = model.grid.xy + state.displacement
    state.mass = static_masses(xy, model.zones, model.modulus)
    state.mass_age = 0
    if state.in_real_time:
        state.dt = min(state.dt, real_step(xy, model))
