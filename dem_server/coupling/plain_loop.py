"""The loop of dem_server/run.py for plain steps, compiled: coupled steps that nobody has to see.

The kernels, their order and their arguments are those of the loop step by step, so the bits are the same.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coupler_protocol.compiled.jit import jit
from coupler_protocol.compiled.lane import HEADER_NUMBERS, HERE, put, take
from coupler_protocol.compiled.system_calls import nanoseconds
from coupler_protocol.compiled.thread_crew import order as order_phase
from coupler_protocol.compiled.thread_crew import over_all_threads, part_of
from coupler_protocol.interface.mapping import forces_to_nodes
from coupler_protocol.wire.messages import Answer, Order
from dem_server.coupling.look import look
from dem_server.coupling.plain_help import CONTACTS as CONTACT_PHASE
from dem_server.coupling.plain_help import MOTION
from dem_server.coupling.rim import move_ring
from dem_server.effects.histories import PairHistory
from dem_server.effects.parameter_table import Parameters
from dem_server.model import CAPS, FX, FY, MOMENT, SPIN, VX, VY, Listed, X, Y
from dem_server.observe.energy import ring_power, stored_kernel
from dem_server.observe.energy_ledger import book_bodies, book_pairs, copy_before, note_energies
from dem_server.observe.pair_work import copy_springs
from dem_server.step import scratch_rows
from dem_server.step.clumps import move_clumps
from dem_server.step.contact_pass import add_inside, add_ring, farthest
from dem_server.step.motion import move

ANSWER, ORDER = len(Answer._fields), len(Order._fields)
STEP, GRAVITY, FACTOR, DT, INTERVAL, FLAGS = (
    Order._fields.index(name) for name in ("step", "gravity", "gravity_factor", "dt", "interval", "flags")
)
NOW, NEXT = range(2)  # of Talk.gravity
LEFT, OF, FROM, SAID = range(4)  # of Talk.pause
DONE, UNHEARD, INFINITE, UNSENT, ODD, CONTACTS, FAST, FAST_RIM, NOTICED, SENT = range(10)  # why the loop ended; FORCE is sent
MOST = 2000  # steps of a call
Numbers = NDArray[np.float64]


class Ring(NamedTuple):
    """Ring of a window of K nodes and R control discs, fields of dem_server.coupling.rim.Rim; sums (K,): of the mass rule.

    force (K,2), carried (R,3): forces on the nodes and on the control discs of the last FORCE; velocity (K,2): of VELOCITY.
    """

    nodes: Numbers
    seg0: NDArray[np.int64]
    seg1: NDArray[np.int64]
    w0: Numbers
    node: NDArray[np.int64]
    paper: bool
    sums: Numbers
    force: Numbers
    carried: Numbers
    velocity: Numbers


class Talk(NamedTuple):
    """answer (8,): of the next FORCE; order (7,): of the last VELOCITY; gravity (2,) [m/s2]: of the step under way, of the next.

    pause (4,): steps until the next exchange, of how many, gravity [m/s2] in the first of them, and whether FORCE was sent in
    this call. first: number of steps done in the run; called: steps between calls of a plugin; leeway [m] until the next list;
    until: monotonic time [ns] after which no step begins.
    """

    answer: Numbers
    order: Numbers
    gravity: Numbers
    pause: Numbers
    first: int
    called: int
    leeway: float
    until: int


class Motion(NamedTuple):
    """gravity [m/s2] of the first step; ring: number of control discs; kick [s]: time of its forces; dt [s]: of every sub-step.

    agreed [s]: length of a step with the continuum, of `substeps`; fastest [m/s]: limit of the speed, longest [m]: of the way
    in a sub-step; cap: whether faster bodies are slowed down, as in static mode, where dt = 1. most: steps of a VELOCITY;
    full [m/s2]: gravity of the stage at factor 1.
    """

    gravity: float
    ring: int
    kick: float
    dt: float
    agreed: float
    substeps: int
    fastest: float
    longest: float
    cap: bool
    most: int
    full: float


@jit(borrows=True)
def write_forces(wire, ring, answer):
    """Writes FORCE into the outbox; returns whether the forces are finite."""
    at, said = (wire.out_at[0] >> 3) + HEADER_NUMBERS, wire.said
    for i in range(ANSWER):
        said[at + i] = answer[i]
    at += ANSWER
    total = 0.0
    for k in range(len(ring.sums)):
        said[at], said[at + 1] = ring.force[k, 0], ring.force[k, 1]
        total += ring.force[k, 0] + ring.force[k, 1]
        at += 2
    for k in range(len(ring.sums)):
        said[at] = ring.sums[k]
        at += 1
    return np.isfinite(total)


@jit(borrows=True)
def send_forces(wire, ring, disc, load, answer):
    """Maps the loads of the ring to its nodes and sends FORCE; returns SENT, INFINITE or UNSENT."""
    R = len(ring.carried)
    force, moment = load[:R, FX : FX + 2], load[:R, MOMENT]
    forces_to_nodes(
        ring.nodes, ring.seg0, ring.seg1, ring.w0, ring.node, disc[:R, X : Y + 1], force, moment, ring.force, ring.paper
    )
    for p in range(R):  # by number: what numba compiles for arrays of two shapes takes seconds
        ring.carried[p, 0], ring.carried[p, 1], ring.carried[p, 2] = load[p, FX], load[p, FY], load[p, MOMENT]
    if not write_forces(wire, ring, answer):
        return INFINITE
    return SENT if put(wire, 0) else UNSENT


@jit(borrows=True)
def read_velocities(wire, ring, order):
    """Copies VELOCITY from the inbox."""
    at, heard = (wire.in_at[0] >> 3) + HEADER_NUMBERS, wire.heard
    for i in range(ORDER):
        order[i] = heard[at + i]
    at += ORDER
    for k in range(len(ring.sums)):
        ring.velocity[k, 0], ring.velocity[k, 1] = heard[at], heard[at + 1]
        at += 2


@jit(borrows=True)
def gravity_after(talk, full):
    """Gravity [m/s2] of the step after the one under way, within the steps of a VELOCITY as in grid_talk.steps_between."""
    order, pause = talk.order, talk.pause
    if pause[LEFT] == 1.0:
        return order[GRAVITY]
    last = full * order[FACTOR]
    return pause[FROM] + (last - pause[FROM]) * ((pause[OF] - pause[LEFT] + 1.0) / (pause[OF] - 1.0))


@jit(borrows=True)
def too_fast(v, dt, longest):
    """Whether a component of the velocities (R,2) is more than `longest` [m] in a step; false for NaN."""
    fastest = 0.0
    for p in range(v.shape[0]):
        fastest = max(fastest, abs(v[p, 0]), abs(v[p, 1]))
    return fastest * dt > longest


@jit(borrows=True)
def largest_square(v):
    """Largest square of the velocities (R,2); NaN if one is NaN."""
    largest = broken = 0.0
    for p in range(v.shape[0]):
        square = v[p, 0] * v[p, 0] + v[p, 1] * v[p, 1]
        largest = max(largest, square)
        broken += 0.0 * square
    return largest + broken


@jit
def add_counts(counts, counters):
    """Moves what other threads have counted, counts (size,n), to the counters (n,)."""
    for other in range(counts.shape[0]):
        for c in range(counts.shape[1]):
            counters[c] += counts[other, c]
            counts[other, c] = 0


@jit
def plain_loop(
    wire, ring, talk, motion, begun, bodies, clumps, listed, history, parameters, counters, sight, ledger, marks, crew, counts
):  # fmt: skip
    """Takes steps, each from FORCE to the contacts after VELOCITY; returns (steps done, why it ended, fast discs or sub-step).

    begun: FORCE of the first step is sent, and what precedes it is seen. sight: a Sight, with room for what MOST steps show.
    ledger: the Book of the stage's energies with such room, or None.
    The step that is not completed has: prepared FORCE (INFINITE: which is not finite; UNSENT), or sent it (NOTICED: what was seen
    then has to be judged), or also moved the free discs (UNHEARD; FAST: too fast without a cap), or also received VELOCITY, which
    is not for the steps that follow (ODD), or also moved the ring in a sub-step (FAST_RIM: too fast; CONTACTS: a new list of
    pairs is due, or somebody has to see the step). If a VELOCITY is for several steps, those before its last one send no FORCE.
    bodies, listed, history, parameters: plain tuples, as for `cycle` and `force_pass`. marks (MOST,2): times [ns] between which
    each step waits for VELOCITY, None without a trace. crew: a Crew whose other threads run `help_discs`, None for one thread;
    counts (size,n): counters of these threads.
    """
    disc, load, weight, angle, listed_at = bodies
    named, past, law = Listed(*listed), PairHistory(*history), Parameters(*parameters)
    scratch = np.empty(scratch_rows.SIZE)
    gravity, R, kick, dt, agreed, substeps, fastest, longest, cap, most, full = motion
    order, pause = talk.order, talk.pause
    x, v, spin = disc[:R, X : Y + 1], disc[:R, VX : VY + 1], disc[:R, SPIN]
    alpha, said = law.alpha, SENT
    first, end = R, disc.shape[0]
    if crew is not None:
        first, end = part_of(crew, R, end)
    moved = talk.leeway  # no disc has moved farther than the sum of the largest speeds (as in dem_server/step/cycle.py)
    for step in range(MOST):
        done = talk.first + step
        last = step + 1 == MOST or nanoseconds(wire.asked) > talk.until
        talk.gravity[NOW] = talk.gravity[NEXT] = gravity
        if not begun:
            if step == 0 and pause[LEFT] == 0.0:
                said = send_forces(wire, ring, disc, load, talk.answer)
                pause[SAID] = 1.0
            if said != SENT:
                return step, said, 0
            due = done % sight.every == 0
            if due and look(done, disc, load, weight, named, past, clumps, R, gravity, counters, talk.answer, sight):
                return step, NOTICED, 0
        begun = False
        for sub in range(substeps):
            fast, quickest = 0, 0.0
            if ledger is not None:
                copy_before(disc, load, weight, clumps, gravity, kick, ledger)
            if crew is not None:
                order_phase(crew, MOTION, gravity, kick)
            if clumps is not None:
                fast, quickest = move_clumps(disc, load, weight, angle, alpha, clumps, gravity, fastest, cap, kick, dt)
            more, other = move(first, end, disc, load, weight, angle, alpha, clumps, gravity, fastest, cap, kick, dt)
            if crew is not None:
                more, other, _ = over_all_threads(crew, more, other, False)
            fast, quickest, kick = fast + more, max(quickest, other), dt
            if cap:
                counters[CAPS] += fast
            elif fast > 0:
                return step, FAST, fast
            if pause[LEFT] == 0.0:
                if marks is not None:
                    marks[step, 0] = nanoseconds(wire.asked)
                if take(wire, 0) != HERE:
                    return step, UNHEARD, 0
                if marks is not None:
                    marks[step, 1] = nanoseconds(wire.asked)
                read_velocities(wire, ring, order)
                wire.sequence[0] += 1
                steps = order[INTERVAL]
                if order[DT] != agreed or not 1.0 <= steps <= most or steps % 1.0 != 0.0 or order[STEP] != done + steps:
                    return step, ODD, 0
                pause[LEFT], pause[OF], pause[FROM] = steps, steps, gravity
            move_ring(ring.nodes, ring.velocity, ring.seg0, ring.seg1, ring.w0, ring.node, x, v, spin, ring.paper, dt)
            if not cap and too_fast(v, dt, longest):
                return step, FAST_RIM, sub
            moved += max(quickest, largest_square(v)) ** 0.5 * dt
            if not moved < 0.999 * talk.leeway:
                moved = farthest(disc, listed_at)
            talk.gravity[NEXT] = gravity_after(talk, full)
            seen = (order[FLAGS] != 0.0 and pause[LEFT] == 1.0) or (done + 1) % talk.called == 0
            if seen or not moved <= talk.leeway:
                return step, CONTACTS, sub
            if ledger is not None:
                book_bodies(disc, load, weight, clumps, R, gravity, dt, ledger)
                if sub == 0 and done % sight.every == 0:
                    stored = stored_kernel(
                        disc, named.first, named.second, named.kind, past.normal, past.shear, past.rolled, past.parallel,
                        sight.spring, sight.parallel_bond,
                    )  # fmt: skip
                    note_energies(done, stored, ledger)
                copy_springs(past, ledger.before)
            if sub == 0 and (done + 1) % sight.every == 0:
                sight.power[0] = ring_power(ring.carried, disc)
            if crew is not None:
                order_phase(crew, CONTACT_PHASE, 0.0, 0.0)
            add_ring(disc, load, named, past, law, dt, counters, crew, scratch)
            if not last and sub + 1 == substeps and pause[LEFT] == 1.0:  # the grid needs no more than the ring's pairs
                said = send_forces(wire, ring, disc, load, talk.answer)
                pause[SAID] = 1.0
            add_inside(disc, load, named, past, law, dt, counters, crew, scratch)
            if crew is not None:
                add_counts(counts, counters)
            if ledger is not None:
                book_pairs(disc, named, past, sight.spring, sight.parallel_bond, dt, ledger)
        gravity = talk.gravity[NEXT]
        pause[LEFT] -= 1.0
        if last:
            return step + 1, DONE, 0
    return MOST, DONE, 0
