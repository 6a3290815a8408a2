"""Plain steps of the discs: as many as possible in one compiled call (plain_loop.py), beside the loop step by step.

A step is plain if nothing outside the kernels has to see it: the continuum orders nothing after it, no plugin is called, no
region is measured, and the list of pairs still holds. Histories need no step of their own: compiled code computes their values
(look.py).
"""

import time
from math import gcd

import numpy as np

from coupler_protocol.compiled.cache_files import is_compiled
from coupler_protocol.compiled.thread_crew import crew_of, lead
from coupler_protocol.exits import PhysicsFailed
from coupler_protocol.process.plugin import interval_of
from coupler_protocol.scene.ending import least_steps
from coupler_protocol.scene.schedule import plan
from coupler_protocol.wire import lanes, messages
from coupler_protocol.wire.lockstep import PATIENCE
from dem_server.coupling import look
from dem_server.coupling.plain_help import help_discs
from dem_server.coupling.plain_loop import (
    CONTACTS,
    DONE,
    FAST,
    FAST_RIM,
    INFINITE,
    LEFT,
    MOST,
    NEXT,
    NOTICED,
    NOW,
    ODD,
    SAID,
    UNHEARD,
    UNSENT,
    Motion,
    Ring,
    Talk,
    plain_loop,
)
from dem_server.effects.histories import history_of
from dem_server.step.contact_pass import contact_forces
from dem_server.step.motion import SPEED_CAP, move_free
from dem_server.step.neighbours import skin
from dem_server.step.thread_shares import shares

NEVER = 1 << 62  # steps between calls of a plugin that there is not
MOVE, RECEIVE, ACCEPT, COMPLETED = range(4)  # how a step goes on, see `take`


def obstacle(side):
    """Why the steps of a stage are taken one by one, or ""."""
    lanes = side.conversation.transport.lanes
    found = {
        "messages of steps use the link": lanes is None or not lanes.whole,
        "a plugin is called after every step": interval_of(side.plugin) == 1,
        "regions are measured after every step": seen_every(side) == 1,
    }
    return next((words for words, there in found.items() if there), "")


def seen_every(side):
    """Steps between those that the plugin or the measuring of regions has to see; 0: there are none. Others do not harm."""
    return gcd(interval_of(side.plugin), side.record_of_stage.measure if side.measuring else 0)


class PlainSteps:
    """Plain steps of one stage of a dem_server.procedure.window_side.DiscreteSide. `taken`: how many so far."""

    def __init__(self, side):
        self.side = side
        self.why_not = obstacle(side)
        self.taken = 0
        self._known = None  # whether plain steps may begin at once, if it was asked
        self._begun = False
        self.every = seen_every(side)
        if not self.why_not:
            self.lanes = side.conversation.transport.lanes
            self.order, self.answer = np.zeros(len(messages.Order._fields)), np.zeros(len(messages.Answer._fields))
            self.gravity, self.pause = np.zeros(2), np.zeros(4)
            self.marks = None if side.scene.record.trace is None else np.zeros((MOST, 2), dtype=np.int64)
            self.sight = look.sight_of(side, MOST)
            self.crew, counters = crew_of(len(shares(side.model))), side.state.counters
            self.counts = None if self.crew is None else np.zeros((self.crew.size, len(counters)), dtype=counters.dtype)

    def take(self):
        """Takes plain steps, from a sent FORCE on; returns (how the present step goes on, its Order or None).

        MOVE: free discs have to be moved. RECEIVE: VELOCITY has to be received. ACCEPT: it was, and has to be obeyed. COMPLETED:
        all of the step is done, and somebody has to see it.
        """
        side, begun = self.side, True
        first = not side.watch.stages[-1].steps  # its message may be STOP, which uses the link
        if self.why_not or first or not self._begins():
            return MOVE, None
        while True:
            side.conversation.stop.check(PATIENCE)
            steps, why, found = self._loop(begun)
            self._count(steps)
            begun = why != DONE
            if why == INFINITE:
                side.refuse_infinite(side.rim.force)
                raise PhysicsFailed(f"the discs cannot take step {side.steps + 1}")  # no step is taken twice
            if why == UNSENT:
                side.conversation.send_by_link()
                self._see_completed()
                return MOVE, None
            if why == NOTICED:
                side.judge_look(side.looked, self.checked)
            if why == FAST:
                side.refuse_fast(found)
            if why == UNHEARD:
                return RECEIVE, None
            if why in (ODD, FAST_RIM, CONTACTS):
                if why == ODD:
                    return ACCEPT, messages.Order(*self.order.tolist())
                if why == FAST_RIM:
                    side.refuse_fast_rim()
                order = self._order_of_step()
                self._complete(order, found)
                called = bool(self.every) and order.step % self.every == 0
                if called and self.pause[LEFT]:
                    self._let_plugin_see(order)
                    begun = True
                elif called or order.flags:
                    return COMPLETED, order
                else:
                    side.count_step(order)
                    self.taken += 1
                    begun = False

    def report(self):
        """Adds to the times of the stage how many plain steps there were, or why none."""
        times = self.side.watch.stages[-1]
        times.plain_steps = self.taken
        if not self.taken:
            times.one_by_one = self.why_not or ("" if self._begun else "the stage was short, and no cache had the loop")

    def _let_plugin_see(self, order):
        """Observes and records a completed step after which no exchange follows."""
        side = self.side
        side.observe(order)
        side.watch.add_to("computing")
        side.record(order)
        side.watch.add_to("recording")
        side.answer = side.looked

    def _order_of_step(self):
        """The Order for the step under way, of a VELOCITY that may be for several."""
        order = messages.Order(*self.order.tolist())
        if self.pause[LEFT] > 1.0:
            order = order._replace(step=self.side.steps + 1.0, gravity=float(self.gravity[NEXT]), flags=0.0)
        return order

    def _complete(self, order, sub):
        """Completes a step from the contacts of its sub-step `sub` on."""
        side, gravity = self.side, float(self.gravity[NOW])
        if sub == 0:
            side.measure_power(order)
        self._contacts(gravity, sub == 0)
        for _ in range(side.substeps - 1 - sub):
            if side.ledger:
                side.ledger.copy_before_step(side.state, gravity)
            side.refuse_fast(move_free(side.model, side.state, gravity))
            side.rim.move(side.state, side.talk.velocity)
            side.refuse_fast_rim()
            self._contacts(gravity, False)
        side.check_step()
        self.pause[LEFT] -= 1.0

    def _contacts(self, gravity, begins):
        """Computes contacts after the ring has moved; begins: in the first sub-step."""
        side = self.side
        if side.ledger:
            side.book_energy(gravity, begins)
        contact_forces(side.model, side.state)
        if side.ledger:
            side.ledger.book_contacts(side.model, side.state)
        side.refuse_passing()

    def _see_completed(self):
        """Looks at the completed step if histories have a point there, as the loop step by step does."""
        side = self.side
        if side.steps % side.record_of_stage.history == 0:
            order = messages.Order(*self.order.tolist())
            side.look(order)
            side.record_histories()
            side.answer = side.looked

    def _begins(self):
        """Whether plain steps are taken: at once if the stage is long or the loop compiled, else if it proves to be long."""
        if not self._begun:
            done, stage = self.side.watch.stages[-1].steps, self.side.scene.stage[self.side.stage]
            if self._known is None:
                self._known = least_steps(stage) >= lanes.EARLIEST or is_compiled(plain_loop, self._arguments(True))
            self._begun = self._known or done >= lanes.EARLIEST
        return self._begun and self.lanes.whole

    def _loop(self, begun):
        """One compiled call."""
        side, wire, talk, state = self.side, self.lanes.wire, self.side.conversation, self.side.state
        wire.sequence[0], wire.waited[0] = talk.sequence, 0
        arguments = self._arguments(begun)
        fresh = self.sight.fresh[0]
        steps, why, fast = plain_loop(*arguments) if self.crew is None else self._loop_of_threads(arguments)
        self.checked = fresh and not self.sight.fresh[0]  # whether discs outside the ring were looked for
        if steps or why not in (INFINITE, UNSENT, NOTICED):
            state.dt = state.next_dt
        talk.continue_from(int(wire.sequence[0]), self.lanes.said(0) if self.pause[SAID] else None)
        side.watch.add_plain_steps(steps, 1e-9 * float(wire.waited[0]), self.marks)
        side.gravity = float(self.gravity[NEXT])
        side.power = float(self.sight.power[0])
        return steps, why, fast

    def _loop_of_threads(self, arguments):
        """The call, with the other threads of the crew."""
        return lead(
            self.crew, lambda: plain_loop(*arguments), lambda crew: help_discs(*self.help_arguments(crew, arguments))
        )  # fmt: skip

    def help_arguments(self, crew, arguments):
        """Arguments of `help_discs` for a thread of the crew beside those of `plain_loop`."""
        _, _, _, motion, _, bodies, clumps, listed, history, parameters, *_ = arguments
        return crew, motion, bodies, clumps, listed, history, parameters, self.counts[crew.rank]

    def _arguments(self, begun):
        """Arguments of `plain_loop`."""
        side = self.side
        model, state, rim = side.model, side.state, side.rim
        self.answer[:] = side.answer_now
        ring = Ring(
            rim.nodes, *rim.where, rim.paper, rim.stiffness_sums(model, state), rim.force, rim.carried, side.talk.velocity
        )
        until, self.pause[SAID] = time.monotonic_ns() + lanes.LONGEST, 0.0
        said = Talk(
            self.answer, self.order, self.gravity, self.pause, side.steps, self.every or NEVER, 0.5 * skin(model), until
        )  # fmt: skip
        self.sight.rows[0], self.sight.power[0] = 0, side.power
        self.sight.broken[:] = 0, -1
        self.sight.fresh[0] = not side.guard.knows_list(state)
        self.book = None if side.ledger is None else side.ledger.book_of_rows(state, len(self.sight.steps))
        longest = SPEED_CAP * model.smallest_radius
        kick, dt = 0.5 * (state.dt + state.next_dt), state.next_dt
        agreed = dt if side.step is None else side.step
        static = not model.in_real_time
        motion = Motion(
            side.gravity, model.ring, kick, dt, agreed, side.substeps, longest / dt, longest, static,
            side.scene.coupling.exchange_every if static else 1, float(plan(side.scene)[side.stage].gravity),
        )  # fmt: skip
        return (
            self.lanes.wire, ring, said, motion, begun,
            (state.disc, state.load, state.weight, state.angle, state.listed_at), state.clumps,
            tuple(state.listed), tuple(history_of(state)), tuple(model.parameters), state.counters, self.sight, self.book,
            self.marks, self.crew, self.counts,
        )  # fmt: skip

    def _count(self, steps):
        """Counts completed steps, and reads what was seen after them."""
        side, begun, time = self.side, self.side.steps, self.side.time
        self.taken += steps
        side.steps += steps
        times = []
        for _ in range(steps):  # as in a sum step by step, bit for bit
            side.time += side.step
            times.append(side.time)
        side.watch.stages[-1].steps += steps
        if self.book is not None and self.book.noted[0]:
            side.recorder.histories(*side.ledger.histories(self.book))
        rows = int(self.sight.rows[0])
        if rows:
            self._note_cracks(begun, time, times)
            side.watch.add_to("computing")
            numbers = self.sight.steps[:rows].tolist()
            answers = [messages.Answer(*row)._replace(stop=0.0) for row in self.sight.answers[:rows].tolist()]
            side.answer = side.looked = answers[-1]
            at = [_time_of(number, begun, time, times) for number in numbers]
            side.note_looks(numbers, answers, at, float(self.order[messages.Order._fields.index("gravity_factor")]))
            side.watch.add_to("recording")

    def _note_cracks(self, begun, time, times):
        """Records the breaks of bonds that the looks of a call have found; those that waited before belong to its first look."""
        side, sight, found = self.side, self.sight, int(self.sight.broken[0])
        waiting, side.state.breaks = side.state.breaks, None
        steps, rows = sight.broken_at[:found] if found else np.zeros(0, dtype=np.int64), sight.breaks[:found] if found else None
        if waiting is not None:
            first = np.full(len(waiting), sight.steps[0])
            steps, rows = np.concatenate([first, steps]), waiting if rows is None else np.concatenate([waiting, rows])
        if rows is not None:
            side.note_cracks(steps, [_time_of(int(step), begun, time, times) for step in steps], rows)


def _time_of(step, begun, time, times):
    """Time [s] after a step of a call that began after step `begun` at `time`; times: after each of its steps."""
    return times[step - begun - 1] if step > begun else time
