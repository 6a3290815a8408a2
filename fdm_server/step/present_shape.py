"""Where gridpoints are, and the masses that go with the present shape. In small strain the shape never changes.

In large strain the position of a gridpoint is always that of the grid plus its displacement. Static masses follow the shape:
every `MASS_STEPS` steps they are computed anew. They hold a factor 2 in reserve of which damping needs 1 + alpha; what is left
(11 % at alpha = 0.8) covers zones that change by half a percent in each of these steps. In real time masses are real, and it is
the step that follows the shape: at the same times it is made shorter where zones have become thinner.
"""

from fdm_server.step.masses import real_step, static_masses

MASS_STEPS = 20


def begin_large_strain(model, state):
    """From now on zones are where their gridpoints are; does nothing where this holds already."""
    if state.mass is None:
        renew(model, state)


def moving(model, state):
    """Positions (N,2) [m] from which displacements count in large strain; None in small strain."""
    return None if state.mass is None else model.grid.xy


def present(model, state):
    """Positions (N,2) [m] that zones compute with."""
    return model.grid.xy if state.mass is None else model.grid.xy + state.displacement


def masses(model, state):
    """Masses (N,) [kg] of the gridpoints: scaled for a step of 1, or real where steps are."""
    if state.in_real_time:
        return model.weight_mass
    return model.mass if state.mass is None else state.mass


def count_step(model, state):
    """Count a step of large strain; masses and steps too old are computed anew."""
    state.mass_age += 1
    if state.mass_age >= MASS_STEPS:
        renew(model, state)


def renew(model, state):
    """Static masses, and a step in real time that is short enough, for the present shape in large strain."""
    xy = model.grid.xy + state.displacement
    state.mass = static_masses(xy, model.zones, model.modulus)
    state.mass_age = 0
    if state.in_real_time:
        state.dt = min(state.dt, real_step(xy, model))
