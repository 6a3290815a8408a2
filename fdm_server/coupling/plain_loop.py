"""The loop of fdm_server/run.py for plain steps, compiled: steps of a coupled stage that nobody has to see.

The kernels, their order and their arguments are those of the loop step by step, so the bits are the same.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coupler_protocol.compiled.jit import jit
from coupler_protocol.compiled.lane import HEADER_NUMBERS, HERE, put, take
from coupler_protocol.wire.messages import Answer, Order
from fdm_server.coupling.rim import apply_forces
from fdm_server.coupling.rim_growth import NOTICED, watch_growth
from fdm_server.step.gridpoint_pass import velocity_kernel
from fdm_server.step.zone_pass import move_kernel, zones_kernel

ANSWER, ORDER = len(Answer._fields), len(Order._fields)
STAGE, STEP, GRAVITY, FACTOR, DT, INTERVAL, FLAGS = range(ORDER)
DONE, MIDWAY, UNHEARD, INFINITE, UNSENT, GROWN, INVERTED, TOO_LONG = range(8)  # why the loop ended
Numbers = NDArray[np.float64]


class Rims(NamedTuple):
    """Rims of W windows, one after the other: K gridpoints in all; begin (W+1,): first one of a rim.

    force (K,2), sums (K,), answer (W, 8): of the last FORCE; added (K,): mass of the gridpoints from it, `sums` or `inner_mass`;
    inner_mass, reaction (K,2), reaction_mass: of the hand-over
    (rim.py); velocity (K,2): of the last VELOCITY; before (K,2), size (W, 5), floor (W,): of the watch of growth.
    """

    nodes: NDArray[np.int64]
    begin: NDArray[np.int64]
    force: Numbers
    sums: Numbers
    answer: Numbers
    added: Numbers
    inner_mass: Numbers
    reaction: Numbers
    reaction_mass: Numbers
    velocity: Numbers
    before: Numbers
    size: Numbers
    floor: Numbers


class Course(NamedTuple):
    """n plain steps ahead: gravity (n+1,) [m/s2], its factor (n+1,), share (n,) of the discs in the rims' forces."""

    gravity: Numbers
    factor: Numbers
    share: Numbers
    stage: float
    first: int  # number of the first step in the run
    seconds: float  # length of a step, 1 in static mode


@jit(borrows=True)
def read_forces(wire, w, rims):
    """Copies FORCE of window w from the inbox."""
    at, heard = (wire.in_at[w] >> 3) + HEADER_NUMBERS, wire.heard
    for i in range(ANSWER):
        rims.answer[w, i] = heard[at + i]
    first, last = rims.begin[w], rims.begin[w + 1]
    at += ANSWER
    for k in range(first, last):
        rims.force[k, 0], rims.force[k, 1] = heard[at], heard[at + 1]
        at += 2
    for k in range(first, last):
        rims.sums[k] = heard[at]
        at += 1


@jit(borrows=True)
def write_velocities(wire, w, rims, velocity, course, step):
    """Writes VELOCITY for window w into the outbox; returns whether all velocities are finite."""
    at, said = (wire.out_at[w] >> 3) + HEADER_NUMBERS, wire.said
    said[at + STAGE], said[at + STEP] = course.stage, course.first + step
    said[at + GRAVITY], said[at + FACTOR] = course.gravity[step + 1], course.factor[step]
    said[at + DT], said[at + INTERVAL], said[at + FLAGS] = course.seconds, 1.0, 0.0
    at += ORDER
    total = 0.0
    for k in range(rims.begin[w], rims.begin[w + 1]):
        n = rims.nodes[k]
        for axis in range(2):
            v = velocity[n, axis]
            rims.velocity[k, axis] = said[at] = v
            total += v
            at += 1
    return np.isfinite(total)


@jit(borrows=True)
def too_long(rims, mass, added_mass, static_mass, dt):
    """Whether the step of a stage in real time has become too long at a rim (fdm_server/coupling/common_step.py, Eq (1))."""
    if dt is not None:
        for k in range(len(rims.nodes)):
            n = rims.nodes[k]
            if dt * dt * (0.5 * static_mass[n] + rims.sums[k]) > mass[n] + added_mass[n]:
                return True
    return False


@jit
def plain_loop(wire, rims, course, points, resistance, always, effects, midway, pauses):
    """Takes the steps of `course`; returns (steps completed, rims heard in the step that is not, why it ended).

    points: applied, added_mass, mass, weight_mass, fixed, static_mass (None in static mode); resistance: damping, half_combined,
    previous, half_drag of `velocity_kernel`; always, effects: of fdm_server.step.zone_pass.zone_arguments.
    midway: the first step has sent its velocities already; pauses: the first step ends there (MIDWAY).
    """
    applied, added_mass, mass, weight_mass, fixed, static_mass = points
    damping, half_combined, previous, half_drag = resistance
    geometry, gather, stiffness, arrays = always
    velocity, displacement, _, _, force = arrays
    mohr_coulomb, tension, softening, plastic, plastic_shear, added, memory, viscosity, dt, xy = effects
    windows, count, strips = len(wire.fd), velocity.shape[0], len(gather[1]) - 2
    all_from = np.int64(0)  # for a literal number numba would compile the kernels once more
    for step in range(len(course.share)):
        unsent = False
        grown = False
        if not midway:
            for w in range(windows):
                if take(wire, w) != HERE:
                    return step, w, UNHEARD
                read_forces(wire, w, rims)
            share, gravity = course.share[step], course.gravity[step]
            apply_forces(
                rims.nodes, rims.force, rims.added, share, gravity, rims.inner_mass, rims.reaction, rims.reaction_mass,
                applied, added_mass,
            )  # fmt: skip
            if too_long(rims, mass, added_mass, static_mass, dt):
                return step, windows, TOO_LONG
            velocity_kernel(
                all_from, count, force, applied, mass, added_mass, weight_mass, fixed, gravity,
                damping, half_combined, previous, half_drag, dt, velocity,
            )  # fmt: skip
            for w in range(windows):
                if not write_velocities(wire, w, rims, velocity, course, step):
                    return step, w, INFINITE
                unsent |= not put(wire, w)
                wire.sequence[w] += 1
            for w in range(windows):
                k0, k1 = rims.begin[w], rims.begin[w + 1]
                grown |= (
                    watch_growth(rims.velocity[k0:k1], rims.before[k0:k1], rims.size[w], rims.floor[w], course.seconds) == NOTICED
                )
            if pauses or unsent or grown:
                return step, windows, UNSENT if unsent else (GROWN if grown else MIDWAY)
        midway = False
        move_kernel(all_from, count, velocity, dt, displacement)
        inverted = zones_kernel(
            all_from, strips, geometry, gather, stiffness, arrays,
            mohr_coulomb, tension, softening, plastic, plastic_shear, added, memory, viscosity, dt, xy,
        )  # fmt: skip
        if inverted > 0:
            return step, windows, INVERTED
    return len(course.share), 0, DONE
