"""A state of discs and a copy of it, both taken on under a moving ring."""

from copy import deepcopy

from dem_server.step.contact_pass import contact_forces
from dem_server.step.motion import move_free


def gone_on_twice(model, state, steps=300):
    """`state` after so many steps and as many again, and a copy, made half way, after the same; contacts were sought anew."""

    def go_on(state):
        for _ in range(steps):
            move_free(model, state, 5.0)
            state.x[: model.ring] += [2e-5, 1e-5]
            contact_forces(model, state)

    go_on(state)
    builds, copy = state.builds, deepcopy(state)
    go_on(state)
    go_on(copy)
    assert state.builds > builds
    return state, copy
