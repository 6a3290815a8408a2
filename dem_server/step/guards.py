"""Guards of the real-time mode against bodies that pass through each other, in one step or because springs are too soft.

A spring of stiffness k stops a body of mass m and speed v after the distance v sqrt(m / k). If this is not small compared with
the smallest radius, bodies are checked in every step, in a coupled window with every new list of pairs: a disc moves by half
the skin of the list at most between two. A disc is going through another disc when the centre of the smaller is
inside the larger, and through a wall when it overlaps the wall by more than 0.9 of its radius. A shorter step would not help, so
the run ends.
"""

import numpy as np

from coupler_protocol.compiled.jit import jit
from dem_server.effects.bond import BONDED
from dem_server.model import MASS, SPIN, VX, VY
from dem_server.pairs import listed_pairs
from dem_server.step import walls

WATCHED = 0.3  # of the smallest radius: stopping distance above which bodies are checked
THROUGH = 0.9  # of a disc's radius: deepest overlap with a wall


def quickest(model, state):
    """Largest speed of any body or wall [m/s], and largest stopping distance against the softest spring [m]."""
    speed, push = quickest_kernel(state.disc, state.clumps, model.ring)
    if state.walls is not None:
        speed = max(speed, float(np.hypot(*state.walls.velocity.T).max(initial=0.0)))
    return speed, push / model.law.spring.normal.min() ** 0.5


@jit
def quickest_kernel(disc, clumps, first):
    """Largest speed, and largest product of speed and root of the mass; for clumps the speed at their tips counts."""
    speed = push = 0.0
    for i in range(first, disc.shape[0]):
        if clumps is not None:  # noqa: SIM102 (numba prunes this line only if it stands alone)
            if clumps.body[i] >= 0:
                continue
        v = (disc[i, VX] ** 2 + disc[i, VY] ** 2) ** 0.5
        speed, push = max(speed, v), max(push, v * disc[i, MASS] ** 0.5)
    if clumps is not None:
        motion = clumps.motion
        for c in range(len(motion)):
            v = (motion[c, VX] ** 2 + motion[c, VY] ** 2) ** 0.5 + abs(motion[c, SPIN]) * clumps.reach[c]
            speed, push = max(speed, v), max(push, v * motion[c, MASS] ** 0.5)
    return speed, push


def refuse_fast_passing(model, state):
    """Raises ArithmeticError if a disc is going through another disc or a wall, where a body is fast enough for it."""
    if quickest(model, state)[1] >= WATCHED * model.smallest_radius:
        refuse_passing(model, state)


def refuse_passing(model, state):
    """Raises ArithmeticError if a disc is going through another disc or through a wall."""
    pairs = listed_pairs(state)
    ri, rj = state.radius[pairs.disc_a], state.radius[pairs.disc_b]
    inside = np.hypot(*pairs.branch.T) < np.maximum(ri, rj)
    inside &= pairs.bond_state != BONDED
    if state.parallel is not None:
        inside &= state.parallel.state[pairs.slot] != BONDED
    for c in np.flatnonzero(inside):
        a, b = int(pairs.disc_a[c]), int(pairs.disc_b[c])
        mass = 1.0 / sum(0.0 if i < model.ring else 1.0 / mass_of(state, i) for i in (a, b))
        stops = min(ri[c], rj[c]) * (model.law.spring.normal[pairs.kind[c]] / mass) ** 0.5
        raise ArithmeticError(f"disc {a} is going through disc {b}: {remedy(stops)}")
    if state.walls is None:
        return
    disc, wall, _, distance = walls.near(state, 0.0)
    for c in np.flatnonzero(distance < (1.0 - THROUGH) * state.radius[disc]):
        i = int(disc[c])
        stiffness = model.law.spring.normal[walls.wall_kinds(model)[model.material[i]]]
        stops = THROUGH * state.radius[i] * (stiffness / mass_of(state, i)) ** 0.5
        raise ArithmeticError(f"disc {i} is going through a wall, number {int(wall[c])}: {remedy(stops)}")


def refuse_fast_walls(model, state, fastest):
    """Raises ArithmeticError if a wall moves by more than `fastest` [m] a step, so that it could jump over a disc."""
    if state.walls is not None:
        speed = float(np.hypot(*state.walls.velocity.T).max(initial=0.0))
        if speed > fastest:
            raise ArithmeticError(f"a wall moves by {speed:.3g} m a step; more than {fastest:.3g} m could jump over a disc")


def remedy(stops):
    """Text of the remedy; stops [m/s]: largest speed that the spring can stop."""
    return (
        f"their spring can stop {stops:.3g} m/s. Stiffer springs can stop more; "
        "discs that overlap so much from the start come apart in a static stage before"
    )


def mass_of(state, i):
    """Mass of the body that disc `i` belongs to [kg/m]."""
    if state.clumps is not None and state.clumps.body[i] >= 0:
        return float(state.clumps.motion[state.clumps.body[i], MASS])
    return float(state.mass[i])
