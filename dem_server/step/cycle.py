"""Many steps of the discs in one call of compiled code, and the guard of the real-time mode.

No speed is capped in real time. If a body would move by more than a tenth of the smallest radius in a step, the step is halved
before it is taken, or after it if forces alone make the body so fast. A step below a thousandth of the stable step ends the run:
the discs fly apart. guards.py decides when a body is too fast for the springs.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from coupler_protocol.compiled.jit import jit
from coupler_protocol.compiled.thread_crew import meet, over_all_threads, work_together
from dem_server.effects.histories import history_of
from dem_server.model import CAPS, SPIN, VX
from dem_server.step import guards, scratch_rows
from dem_server.step.clumps import move_clumps
from dem_server.step.contact_pass import add_list, contact_forces, farthest
from dem_server.step.masses import stable_step
from dem_server.step.motion import SPEED_CAP, move
from dem_server.step.neighbours import rebuild, skin
from dem_server.step.thread_shares import shares
from dem_server.step.wall_surface import room_for
from dem_server.step.walls import move_walls, wall_pass_of


class Bodies(NamedTuple):
    """Moving bodies as an argument of `cycle`: fields of State."""

    disc: np.ndarray
    load: np.ndarray
    weight: np.ndarray
    angle: np.ndarray
    listed_at: np.ndarray


class Pace(NamedTuple):
    """gravity [m/s2]; fastest [m/s]: limit of the speed; cap: faster bodies are slowed down; leeway [m] until the next list."""

    gravity: float
    fastest: float
    cap: bool
    leeway: float


SHORTEST = 1e-3  # of the stable step: no shorter one is tried


def in_real_time(model, state, fraction):
    """The model in real time, steps of `fraction` of the stable one; discs that moved in static mode come to rest first.

    Velocities are then those of this moment, not of half a step before: the first kick takes half a step.
    Raises ArithmeticError where discs overlap so deeply that their springs would push them through each other.
    """
    static, model = not model.in_real_time, replace(model, real_time=fraction)
    if static:
        stop(state)
        state.dt = 0.0
    state.next_dt = np.inf
    rebuild(model, state)
    guards.refuse_passing(model, state)
    return model


def in_static_mode(model, state):
    """The model in static mode, steps of 1; discs that moved in real time come to rest first.

    Raises ArithmeticError where a wall would move by more than a tenth of the smallest radius a step.
    """
    real, model = model.in_real_time, replace(model, real_time=None)
    if real:
        stop(state)
        state.dt = state.next_dt = 1.0
    rebuild(model, state)
    guards.refuse_fast_walls(model, state, SPEED_CAP * model.smallest_radius)
    return model


def stop(state):
    """Sets the velocities of all discs and clumps to zero."""
    state.disc[:, VX : SPIN + 1] = 0.0
    if state.clumps is not None:
        state.clumps.motion[:, VX : SPIN + 1] = 0.0


def advance(model, state, gravity, steps):
    """`steps` steps of motion and contact forces under `gravity` [m/s2]; returns the time they took [s].

    As many steps as possible stay in compiled code. Raises ArithmeticError where the step of the real-time mode would have to
    become too short.
    """
    time = 0.0
    while steps > 0:
        ahead = steps if not model.in_real_time else guarded(model, state, steps)
        done, fast, fresh = cycle_shares(model, state, gravity, ahead)
        steps -= done
        time += done * state.dt
        if not fresh:
            contact_forces(model, state)
        if fast > 0 and model.in_real_time:
            shorten(model, state)
    return time


def cycle_shares(model, state, gravity, steps):
    """`cycle` by as many threads as there are shares of the discs; the bits do not depend on their number."""
    kick, dt = 0.5 * (state.dt + state.next_dt), state.next_dt
    state.dt = dt
    known = (
        steps, kick, dt, bodies_of(state), pace_of(model, state, gravity), state.listed, history_of(state), model.parameters,
        state.clumps, state.walls, model.material, model.materials,
    )  # fmt: skip

    def work(begin, end, counters, crew):
        return cycle(*known, begin, end, counters, crew)

    split = shares(model)
    return work(*split[0], state.counters, None) if len(split) == 1 else work_together(work, split, state.counters)[0]


def bodies_of(state):
    """The Bodies of a State."""
    return Bodies(state.disc, state.load, state.weight, state.angle, state.listed_at)


def pace_of(model, state, gravity):
    """The Pace of the next steps under `gravity` [m/s2]."""
    fastest = SPEED_CAP * model.smallest_radius / state.next_dt
    return Pace(gravity, fastest, not model.in_real_time, 0.5 * skin(model))


def guarded(model, state, steps):
    """Shorten the next step of the real-time mode where a body is too fast for it already; returns how many steps may follow."""
    speed, way = guards.quickest(model, state)
    while speed * state.next_dt > SPEED_CAP * model.smallest_radius:
        shorten(model, state)
    if way < guards.WATCHED * model.smallest_radius:
        return steps
    guards.refuse_passing(model, state)
    return 1


def shorten(model, state):
    """Halve the next step of the real-time mode; raises ArithmeticError where it gets too short."""
    state.next_dt *= 0.5
    if state.next_dt < SHORTEST * stable_step(model, state):
        speed, _ = guards.quickest(model, state)
        raise ArithmeticError(f"a disc, stone or wall moves at {speed:.3g} m/s: too fast for any sensible time step")


@jit
def cycle(
    steps, kick, dt, bodies, pace, listed, history, parameters, clumps, walls, material, materials, begin, end, counters, crew
):  # fmt: skip
    """Kernel of `advance`: steps done, bodies that were too fast in the last, whether its contact forces are known.

    It ends early if the list is out of date or, without `cap`, a body is too fast. No disc has moved farther than the sum
    of the largest speeds; only where that comes to `leeway` [m], but for rounding, all are looked at. Discs begin..end-1
    are moved here: all free ones (`crew` None), or the share of one of several threads that do the same at the same time.
    """
    disc, load, weight, angle, listed_at = bodies
    gravity, fastest, cap, leeway = pace
    alpha, scratch = parameters.alpha, np.empty(scratch_rows.SIZE)
    if walls is not None:
        servo = walls.servo  # opened here: in the loop every opening would count references
        touching = room_for(walls.ends)
    fast, fresh, step, moved = 0, True, 0, leeway
    first_of_all = True
    if crew is not None:
        first_of_all = crew.rank == 0
    while step < steps and fresh and (fast == 0 or cap):
        fast, quickest = move(begin, end, disc, load, weight, angle, alpha, clumps, gravity, fastest, cap, kick, dt)
        if clumps is not None:  # noqa: SIM102 (numba prunes this line only if it stands alone)
            if first_of_all:
                more, other = move_clumps(disc, load, weight, angle, alpha, clumps, gravity, fastest, cap, kick, dt)
                fast += more
                quickest = max(quickest, other)
        if cap:
            counters[CAPS] += fast
        strayed = False
        if walls is not None:  # noqa: SIM102 (numba prunes this line only if it stands alone)
            if first_of_all:
                strayed = move_walls(walls, servo, listed_at, leeway, dt)
        if crew is not None:
            fast, quickest, strayed = over_all_threads(crew, fast, quickest, strayed)
        if strayed:
            moved = leeway
        moved += quickest**0.5 * dt
        if not moved < 0.999 * leeway:
            moved = farthest(disc, listed_at)
            fresh = moved <= leeway
        if fresh:
            add_list(disc, load, listed, history, parameters, dt, counters, crew, scratch)
        if walls is not None:  # noqa: SIM102 (numba prunes this line only if it stands alone)
            if fresh and first_of_all:
                wall_pass_of(disc, load, dt, walls, servo, material, materials, clumps, parameters, touching)
        if crew is not None:
            meet(crew)
        kick = dt
        step += 1
    return step, fast, fresh
