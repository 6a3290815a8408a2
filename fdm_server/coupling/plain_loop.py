"""The loop of fdm_server/run.py for plain steps, compiled: steps of a coupled stage that nobody has to see.

The kernels, their order and their arguments are those of the loop step by step, so the bits are the same.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coupler_protocol.compiled.jit import jit
from coupler_protocol.compiled.lane import HEADER_NUMBERS, HERE, put, take
from coupler_protocol.compiled.system_calls import nanoseconds
from coupler_protocol.compiled.thread_crew import meet, order, over_all_threads, part_of
from coupler_protocol.wire.messages import Answer, Order
from fdm_server.coupling.exchange_pauses import BEGINS, add_path, due, judges_now, note_forces, note_velocities
from fdm_server.coupling.look import compare, look, note, note_moved
from fdm_server.coupling.plain_help import VELOCITIES, ZONES
from fdm_server.coupling.rim import apply_forces
from fdm_server.coupling.rim_growth import NOTICED as GROWS
from fdm_server.coupling.rim_growth import watch_growth, watch_power
from fdm_server.ground.boundaries_in_time import drive_sides
from fdm_server.ground.quiet_sides import absorb_all
from fdm_server.ground.shaking import shake_forces, shake_velocities
from fdm_server.observe.energy import strain_kernel
from fdm_server.observe.energy_ledger import book_points, book_zones, copy_before, note_energies
from fdm_server.step.forces import sum_at_gridpoints
from fdm_server.step.gridpoint_pass import velocity_kernel
from fdm_server.step.masses import add_static_masses
from fdm_server.step.momentum import take_momentum_of
from fdm_server.step.nodal_pass import Averages, average_changes, average_strains
from fdm_server.step.zone_pass import move_kernel, zones_kernel

ANSWER, ORDER = len(Answer._fields), len(Order._fields)
STAGE, STEP, GRAVITY, FACTOR, DT, INTERVAL, FLAGS = range(ORDER)
POWER = Answer._fields.index("power")
EXCESS = Averages._fields.index("excess")
DONE, UNHEARD, INFINITE, UNSENT, NOTICED, INVERTED, TOO_LONG = range(7)  # why the loop ended
Numbers = NDArray[np.float64]


class Rims(NamedTuple):
    """Rims of W windows, one after the other: K gridpoints in all; begin (W+1,): first one of a rim.

    force (K,2), sums (K,), answer (W,8): of the last FORCE; added (K,): mass of the gridpoints from it, `sums` or `inner_mass`.
    inner_mass, reaction (K,2), reaction_mass: of the hand-over (rim.py). velocity (K,2): of the last VELOCITY. before (K,2),
    size (W,7), floor (W,), every, awaited (W,3,3), verdict (W,5): of the watches of growth and power (rim_growth.py).
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
    every: int
    awaited: Numbers
    verdict: Numbers


class Renewal(NamedTuple):
    """Static masses in large strain (step/present_shape.py): drawn, present (N,2) [m]: gridpoints as drawn, and scratch memory.

    zones (A,4), modulus (A,) [Pa]; age (1,): steps since the masses were computed; every: after how many they are again.
    """

    drawn: Numbers
    present: Numbers
    zones: NDArray[np.int64]
    modulus: Numbers
    age: NDArray[np.int64]
    every: int


class Course(NamedTuple):
    """n plain steps ahead: gravity (n+1,) [m/s2], its factor (n+1,), share (n,) of the discs in the rims' forces.

    stage: its number; first, noted: numbers of the first step, and of the last one after which histories are noted; done: steps
    of the stage before the first; seconds: length of a step, 1 in static mode; until: monotonic time [ns] after which no step
    begins.
    """

    gravity: Numbers
    factor: Numbers
    share: Numbers
    stage: float
    first: int
    noted: int
    done: int
    seconds: float
    until: int


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
def copy_velocities(rims, velocity):
    """Sets the rims' velocities to those (N,2) of the step."""
    for k in range(len(rims.nodes)):
        for axis in range(2):
            rims.velocity[k, axis] = velocity[rims.nodes[k], axis]


@jit
def pause(rims, velocity, number, pauses):
    """Decides whether an exchange follows the step with this number: returns the steps since the last one, or 0.

    Sets the rims' velocities to the means of these steps.
    """
    pace, path = pauses
    add_path(rims.nodes, velocity, path, pace)
    note_velocities(rims.nodes, rims.velocity, velocity, pace)
    interval = due(number, False, pace)
    if interval > 0:
        for k in range(len(rims.nodes)):
            for axis in range(2):
                rims.velocity[k, axis] = path[k, axis] / interval
    return interval


@jit(borrows=True)
def write_velocities(wire, w, rims, course, step, interval):
    """Writes VELOCITY for window w into the outbox; returns whether all velocities are finite."""
    at, said = (wire.out_at[w] >> 3) + HEADER_NUMBERS, wire.said
    said[at + STAGE], said[at + STEP] = course.stage, course.first + step
    said[at + GRAVITY], said[at + FACTOR] = course.gravity[step + 1], course.factor[step]
    said[at + DT], said[at + INTERVAL], said[at + FLAGS] = course.seconds, interval, 0.0
    at += ORDER
    total = 0.0
    for k in range(rims.begin[w], rims.begin[w + 1]):
        for axis in range(2):
            v = rims.velocity[k, axis]
            said[at] = v
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


@jit(borrows=True)
def watch_rims(rims, number, seconds):
    """Watches growth and power of the rims in a step with this number, of some seconds; returns whether one has to be judged."""
    noticed = False
    for w in range(len(rims.floor)):
        k0, k1 = rims.begin[w], rims.begin[w + 1]
        velocity = rims.velocity[k0:k1]
        noticed |= watch_growth(velocity, rims.before[k0:k1], rims.size[w], rims.floor[w], seconds) == GROWS
        noticed |= watch_power(
            rims.force[k0:k1], velocity, rims.answer[w, POWER], number, rims.every, rims.awaited[w], rims.verdict[w]
        )
    return noticed


@jit
def count_step(renewal, displacement, mass):
    """Counts a step; computes `mass` (N,) [kg] for the present shape if it is due, as fdm_server.step.present_shape.renew."""
    drawn, present, zones, modulus, age, every = renewal
    age[0] += 1
    if age[0] >= every:
        age[0] = 0
        for n in range(len(mass)):
            mass[n] = 0.0
            present[n, 0], present[n, 1] = drawn[n, 0] + displacement[n, 0], drawn[n, 1] + displacement[n, 1]
        add_static_masses(present, zones, modulus, mass)


@jit
def book_all_zones(geometry, stiffness, velocity, seconds, stress, nodal, xy, displacement, ledger):
    """Books the works of stresses in the step; nodal: of `plain_loop`, with the averages of the step, or None."""
    if nodal is None:
        book_zones(geometry, stiffness, velocity, seconds, stress, None, xy, displacement, ledger)
    else:
        book_zones(geometry, stiffness, velocity, seconds, stress, nodal[1][EXCESS], xy, displacement, ledger)


@jit
def plain_loop(
    wire, rims, course, points, resistance, always, effects, renewal, nodal, sides, midway, sight, pauses, ledger, marks, crew
):  # fmt: skip
    """Takes the steps of `course`; returns (steps completed, rims heard in the step that is not, why it ended).

    points: applied, added_mass, mass, weight_mass, fixed, static_mass (None in static mode); resistance: damping, half_combined,
    previous, half_drag of `velocity_kernel`, and `before` of `take_momentum_of`; always, effects: of
    fdm_server.step.zone_pass.zone_arguments; renewal: a Renewal in static large strain, else None; nodal: (Nodal, Averages, its
    `trial`) as plain tuples if volumetric strain is averaged at
    gridpoints, else None; sides: the arguments of `drive_sides`, `absorb_all` and `shake_velocities`, and the Moved of histories,
    each may be None; sight: the Sight of the stage; ledger: the Book of its energies, or None. pauses: (Pauses of its Pace, path
    (K,2) [m] of the rims since the last exchange), None with an exchange in every step. midway: the first step has sent its
    velocities and looked already. marks (n,2): times [ns] between which each step waits for FORCE, None without a trace. crew: a
    Crew whose other threads run `help_grid`, None for one thread.
    """
    applied, added_mass, mass, weight_mass, fixed, static_mass = points
    damping, half_combined, previous, half_drag, before_peak = resistance
    geometry, gather, stiffness, arrays = always
    velocity, displacement, stress, corner_force, force = arrays
    drive, quiet, shaken, moved = sides
    mohr_coulomb, tension, softening, plastic, plastic_shear, added, memory, viscosity, dt, xy = effects
    windows, count, strips = len(wire.fd), velocity.shape[0], len(gather[1]) - 2
    first = strip = np.int64(0)  # for a literal number numba would compile the kernels once more
    last, end = count, strips
    if crew is not None:
        first, last = part_of(crew, 0, count)
        strip, end = part_of(crew, 0, strips)
    for step in range(len(course.share)):
        if step > 0 and nanoseconds(wire.asked) > course.until:
            return step, 0, DONE
        number, gravity = course.first + step, course.gravity[step]
        if not midway:
            begins, interval = True, 1
            if pauses is not None:
                begins = pauses[0].now[BEGINS] != 0.0
            if marks is not None:
                marks[step, 0] = nanoseconds(wire.asked)
            for w in range(windows if begins else 0):
                if take(wire, w) != HERE:
                    return step, w, UNHEARD
                read_forces(wire, w, rims)
            if marks is not None:
                marks[step, 1] = nanoseconds(wire.asked)
            apply_forces(
                rims.nodes, rims.force, rims.added, course.share[step], gravity, rims.inner_mass, rims.reaction,
                rims.reaction_mass, applied, added_mass,
            )  # fmt: skip
            if too_long(rims, mass, added_mass, static_mass, dt):
                return step, windows, TOO_LONG
            if pauses is not None:  # noqa: SIM102 (numba prunes this line only if it stands alone)
                if begins:
                    note_forces(rims.nodes, rims.sums, mass, pauses[0])
            if ledger is not None:
                copy_before(velocity, stress, ledger)
            if crew is not None:
                order(crew, VELOCITIES, gravity, 0.0)
            velocity_kernel(
                first, last, force, applied, mass, added_mass, weight_mass, fixed, gravity,
                damping, half_combined, previous, half_drag, dt, velocity,
            )  # fmt: skip
            if crew is not None:
                meet(crew)
            take_momentum_of(mass, added_mass, velocity, before_peak)
            drive_sides(drive, course.done + step, velocity)
            shake_velocities(shaken, course.seconds, velocity)
            if pauses is None:
                copy_velocities(rims, velocity)
            else:
                interval = pause(rims, velocity, number, pauses)
            sends, unsent = interval > 0, False
            for w in range(windows if sends else 0):
                if not write_velocities(wire, w, rims, course, step, interval):
                    return step, w, INFINITE
                unsent |= not put(wire, w)
                wire.sequence[w] += 1
            if ledger is not None:
                book_points(
                    force, applied, weight_mass, mass, added_mass, fixed, gravity, course.seconds, velocity, None,
                    rims.nodes, rims.force, ledger,
                )  # fmt: skip
            noticed = sends and watch_rims(rims, number, course.seconds)
            looks = judged = (number - 1) % sight.every == 0
            if looks:
                noticed |= look(rims, points, arrays, gravity, course.seconds, sight)
            if ledger is not None:  # noqa: SIM102 (numba prunes this line only if it stands alone)
                if looks:
                    note_energies(number - 1, strain_kernel(geometry, stiffness, stress, displacement, xy), ledger)
            if pauses is not None:
                judged = judges_now(looks, pauses[0])
            if judged:
                noticed |= compare(number - 1, rims, points, gather, arrays, gravity, sight)
            if unsent or noticed:
                return step, windows, UNSENT if unsent else NOTICED
        midway = False
        if crew is not None:
            order(crew, ZONES, 0.0, 0.0)
        move_kernel(first, last, velocity, dt, displacement)
        if crew is not None:
            meet(crew)
        if nodal is not None:
            joints, averages, trial = nodal
            average_strains(
                strips, joints, averages, geometry, stiffness, velocity, displacement, dt, xy, stress, trial
            )  # fmt: skip
        inverted = zones_kernel(
            strip, end, geometry, gather, stiffness, arrays,
            mohr_coulomb, tension, softening, plastic, plastic_shear, added, memory, viscosity, dt, xy,
        )  # fmt: skip
        if crew is not None:
            inverted, _, _ = over_all_threads(crew, inverted, 0.0, False)
            in_order, ready, start, place = gather  # gridpoints at the seam between shares
            sum_at_gridpoints(in_order, ready[strips], ready[strips + 1], start, place, corner_force, force)
        if nodal is not None:
            average_changes(
                strips, joints, averages, geometry, gather, displacement, xy, stress, trial, corner_force, force
            )  # fmt: skip
        if inverted > 0:
            return step, windows, INVERTED
        if ledger is not None:
            book_all_zones(geometry, stiffness, velocity, course.seconds, stress, nodal, xy, displacement, ledger)
        if renewal is not None:
            count_step(renewal, displacement, mass)
        absorb_all(quiet, velocity, applied)
        shake_forces(shaken, course.seconds, applied)
        if number % sight.every == 0 and number <= course.noted:
            note(number, course.factor[step], points, arrays, gravity, sight)
            note_moved(moved, displacement, sight)
    return len(course.share), 0, DONE
