"""Plain steps of a coupled stage: as many as possible in one compiled call (plain_loop.py), beside the loop step by step.

A step is plain if nothing outside the kernels has to see it: it writes no frame, is not the last of the stage, and no effect of
the stage acts between its kernels. Histories need no step of their own: compiled code notes their values (look.py), and
only what has to be judged at once ends a call, in the middle of a step, from where the next one goes on.
"""

import time

import numpy as np

from coupler_protocol.compiled.cache_files import is_compiled
from coupler_protocol.compiled.thread_crew import crew_of, lead
from coupler_protocol.process.plugin import interval_of
from coupler_protocol.scene.ending import least_steps
from coupler_protocol.wire import lanes, messages
from coupler_protocol.wire.lockstep import PATIENCE
from fdm_server.coupling import look
from fdm_server.coupling.common_step import check_common_step
from fdm_server.coupling.plain_help import help_grid
from fdm_server.coupling.plain_loop import (
    DONE,
    INFINITE,
    INVERTED,
    TOO_LONG,
    UNHEARD,
    UNSENT,
    Course,
    Renewal,
    Rims,
    plain_loop,
)
from fdm_server.step import clock
from fdm_server.step import present_shape as shape
from fdm_server.step.gridpoint_pass import resistance
from fdm_server.step.nodal_pass import averages_of
from fdm_server.step.safety import Unstable, check_zones
from fdm_server.step.zone_pass import zone_arguments

MOST = 2000  # steps of a call


def obstacle(side, stage):
    """Why the steps of a stage are taken one by one, or ""."""
    lanes = side.hub.transport.lanes
    parts = side.model.partition
    found = {
        "messages of steps use the link": lanes is None or not lanes.whole,
        "a plugin is called after every step": interval_of(side.plugin) == 1,
        "volumetric strain is averaged at gridpoints by several threads": side.model.nodal is not None and len(parts.strips) > 1,
    }
    return next((words for words, there in found.items() if there), "")


class PlainSteps:
    """Plain steps of one stage of a fdm_server.procedure.grid_side.ContinuumSide. `taken`: how many so far."""

    def __init__(self, side, stage):
        self.side, self.stage = side, stage
        self.why_not = obstacle(side, stage)
        self.taken = 0
        self._known = None  # whether plain steps may begin at once, if it was asked
        self._begun = False
        if not self.why_not:
            self.lanes = side.hub.transport.lanes
            self.rims = _side_by_side(stage, side.state.in_real_time)
            self.pauses = None if stage.pace.every == 1 else (stage.pace.pauses, _paths(stage.rims))
            self.renewal = _renewal(side.model, side.state)
            self.marks = None if side.scene.record.trace is None else np.zeros((MOST, 2), dtype=np.int64)
            self.sight, self.names = look.sight_of(side, stage, MOST)
            self.moved = look.moved_of(self.sight, side.state.driven)
            self.crew = crew_of(len(side.model.partition.strips))
            self.averages = None if side.model.nodal is None else averages_of(side.model)
            self.book = None if stage.ledger is None else stage.ledger.book_of_rows(len(self.sight.looks))

    def take(self):
        """Takes all plain steps from the present one on; returns before the first step that has to be taken by itself."""
        while not self.why_not and not self._loads_change() and self._begins() and (count := self._ahead()) and self._call(count):
            pass

    def _loads_change(self):
        """Whether an excavation, a surcharge or another load has not come to its end."""
        return any(ramp.moves or not ramp.complete for ramp in self.stage.ramps)

    def _begins(self):
        """Whether plain steps are taken: at once if the stage is long or the loop compiled, else if it proves to be long."""
        if not self._begun:
            if self._known is None:
                long = least_steps(self.stage.stage) >= lanes.EARLIEST
                self._known = long or is_compiled(plain_loop, self._arguments(self._course(0), False))
            self._begun = self._known or self.stage.done >= lanes.EARLIEST
        return self._begun and self.lanes.whole

    def report(self):
        """Content of run.json."""
        why = self.why_not
        if not why and not self._begun:
            why = "loads change" if self._loads_change() else "the stage was short, and no cache had the loop"
        elif not why and not self.lanes.whole:
            why = "the lane was closed"
        return {"plain_steps": self.taken} | ({"one_by_one": why} if why else {})

    def _ahead(self):
        """Number of plain steps up to the next frame, call of a plugin, change of masses, or end."""
        side, stage, record = self.side, self.stage, self.stage.record
        if stage.ended_by or any(rim.talk.strain_asked for rim in stage.rims) or not stage.step_is_known:
            return 0
        if stage.checkpoint_due(side.steps + 1) or (stage.ledger and not stage.ledger.begun):
            return 0
        count = min(MOST, record.every - 1 - side.steps % record.every, side.clock.steps_before(side.steps + 1))
        if every := interval_of(side.plugin):
            count = min(count, every - 1 - side.steps % every)
        if side.state.mass is not None and side.state.in_real_time:  # the step may change with the masses
            count = min(count, shape.MASS_STEPS - side.state.mass_age)
        if stage.stage.until.steps is not None:
            count = min(count, stage.stage.until.steps - 1 - stage.done)
        return max(stage.steps_within_time(count), 0)

    def _call(self, count):
        """Takes `count` plain steps; returns whether all of them were taken."""
        side, stage = self.side, self.stage
        side.hub.stop.check(PATIENCE)
        course, midway = self._course(count), False
        while True:
            steps, heard, why = self._loop(course, midway)
            self._count(steps, course.noted)
            if why == DONE:
                return True
            if why == UNHEARD:
                for rim in stage.rims[:heard]:
                    rim.heard = True
                return False
            if why in (INFINITE, TOO_LONG, INVERTED):
                self._record_energies()
                self._refuse(why, heard)
            if why == UNSENT:
                for rim in stage.rims:
                    rim.talk.conversation.send_by_link()
            stage.judge_plain_step(looked=side.steps % stage.record.history == 0)
            self._record_energies()
            course, midway = _after(course, steps), True
            if stage.ended_by:  # this step is completed, the next one is the last
                course = course._replace(gravity=course.gravity[:2], factor=course.factor[:2], share=course.share[:1])

    def _refuse(self, why, row):
        """Raises what the loop step by step raises there; row: of the rim. Raises Unstable or PhysicsFailed."""
        side, rims = self.side, self.stage.rims
        if why == INFINITE:
            rims[row].talk.refuse_infinite(self.rims.velocity[slice(*self.rims.begin[row : row + 2])], side.steps + 1)
        if why == TOO_LONG:
            check_common_step(side.model, side.state, rims, side.state.dt)
        check_zones(shape.present(side.model, side.state), side.model.zones, side.model.zone, side.model.grid.origin)
        raise Unstable(f"the grid cannot take step {side.steps + 1}")  # no step is taken twice

    def _course(self, count):
        """The Course of the next `count` steps."""
        side, stage = self.side, self.stage
        factor = stage.leg.factors(stage.done, count + 1)
        gravity, share = stage.leg.gravity * factor, stage.shares(stage.done, count)
        last = side.steps + count
        # after the last step the masses of large strain in real time may change, then histories follow
        noted = last - 1 if side.state.mass is not None and side.state.in_real_time else last
        number, until = float(stage.index), time.monotonic_ns() + lanes.LONGEST
        return Course(gravity, factor, share, number, side.steps + 1, noted, stage.done, clock.seconds(side.state), until)

    def _loop(self, course, midway):
        """One compiled call."""
        wire = self.lanes.wire
        conversations = [rim.talk.conversation for rim in self.stage.rims]
        wire.sequence[:] = [talk.sequence for talk in conversations]
        wire.waited[0] = 0
        self.sight.rows[:] = 0
        self.sight.ratio[0] = self.stage.ratio
        if self.pauses is not None:  # the first step may be one under forces that were received step by step
            self.rims.sums[:] = np.concatenate([rim.sums for rim in self.stage.rims])
            self.rims.answer[:] = [rim.answer for rim in self.stage.rims]
        arguments = self._arguments(course, midway)
        found = plain_loop(*arguments) if self.crew is None else self._loop_of_threads(arguments)
        for row, talk in enumerate(conversations):
            sequence = int(wire.sequence[row])
            talk.continue_from(sequence, self.lanes.said(row) if sequence != talk.sequence else None)
        for row, rim in enumerate(self.stage.rims):
            rim.answer = messages.Answer(*self.rims.answer[row].tolist())
            rim.sums = self.rims.sums[slice(*self.rims.begin[row : row + 2])].copy()
        self.stage.pace.note_fall_back()
        self.side.watch.add_plain_steps(found[0], 1e-9 * float(wire.waited[0]), self.marks)
        return found

    def _arguments(self, course, midway):
        """Arguments of `plain_loop`."""
        model, state = self.side.model, self.side.state
        static_mass = shape.static_mass(model, state) if state.in_real_time else None
        if self.renewal is not None:
            self.renewal.age[0] = state.mass_age
        points = (state.applied, state.added_mass, shape.masses(model, state), model.weight_mass, model.fixed, static_mass)
        momentum = self.stage.momentum and self.stage.momentum.before
        drag, (always, effects) = (*resistance(model, state, state.dt), momentum), zone_arguments(model, state)
        nodal = self.averages and (tuple(model.nodal), tuple(self.averages), self.averages.trial)
        sides = *self.stage.sides.arguments(state, self.stage.time), self.moved
        return (
            self.lanes.wire, self.rims, course, points, drag, always, effects, self.renewal, nodal, sides, midway, self.sight,
            self.pauses, self.book, self.marks, self.crew,
        )  # fmt: skip

    def _loop_of_threads(self, arguments):
        """The call, with the other threads of the crew."""
        shared = arguments[3:7]  # points, resistance, always, effects
        return lead(self.crew, lambda: plain_loop(*arguments), lambda crew: help_grid(crew, *shared))

    def _count(self, steps, noted):
        """Counts completed steps, and reads what was seen during and after them; noted: of the Course."""
        side, stage, rows = self.side, self.stage, self.sight.looks[: self.sight.rows[0]]
        begun, time = side.steps, side.time
        self.taken += steps
        stage.plain_steps_done(steps)
        before = side.steps - stage.done
        if len(rows):
            stage.note_looks((int(done) - before, (ratio, largest), far) for done, ratio, largest, far in rows.tolist())
        self._record_energies(side.steps)
        if self.renewal is not None:
            side.state.mass_age = int(self.renewal.age[0])
        elif side.state.mass is not None and steps:
            shape.count_steps(side.model, side.state, steps)
        if self.sight.rows[1]:
            side.watch.add_to("computing")
            numbers, values = look.values(self.sight, self.names)
            if side.state.in_real_time:
                values["time"] = stage.times(time, [number - begun for number in numbers])
            side.recorder.histories(numbers, values)
            moved = look.movements(self.sight, self.moved, self.names) if self.moved else {}
            for name, (at, means) in moved.items():
                side.recorder.histories(at, {name: means})
            side.watch.add_to("recording")
        if steps and side.steps > noted and side.steps % stage.record.history == 0:
            side.watch.add_to("computing")
            side.record(stage, stage.plain_order())
            side.watch.add_to("recording")

    def _record_energies(self, below=np.inf):
        """Records the energies noted of steps `below` a number; the last look is judged before its energies are recorded."""
        if self.book is not None and self.book.noted[0]:
            self.side.watch.add_to("computing")
            self.side.recorder.histories(*self.stage.ledger.histories(self.book, True, below))
            self.side.watch.add_to("recording")


def _renewal(model, state):
    """The Renewal of static masses in large strain, or None."""
    if state.mass is None or state.in_real_time:
        return None
    age = np.array([state.mass_age])
    return Renewal(model.grid.xy, np.zeros_like(model.grid.xy), model.zones, model.modulus, age, shape.MASS_STEPS)


def _side_by_side(stage, in_real_time):
    """Rims of all windows in one set of arrays; forces and velocities of the rims become views of them."""
    rims, watches = stage.rims, stage.interface
    begin = np.concatenate([[0], np.cumsum([len(rim.nodes) for rim in rims])])
    sums, inner_mass = (np.concatenate(each) for each in zip(*((rim.sums, rim.inner_mass) for rim in rims), strict=True))
    of_all = Rims(
        np.concatenate([rim.nodes for rim in rims]),
        begin,
        np.concatenate([rim.force for rim in rims]),
        sums,
        np.array([rim.answer for rim in rims]),
        inner_mass if in_real_time else sums,
        inner_mass,
        np.concatenate([rim.reaction for rim in rims]),
        np.concatenate([rim.reaction_mass for rim in rims]),
        np.concatenate([rim.before for rim in rims]),
        np.concatenate([watch.growth.before for watch in watches]),
        np.array([watch.growth.size for watch in watches]),
        np.array([watch.growth.floor for watch in watches]),
        watches[0].power.every,
        np.array([watch.power.awaited for watch in watches]),
        np.array([watch.power.verdict for watch in watches]),
    )
    for row, (rim, watch) in enumerate(zip(rims, watches, strict=True)):
        own = slice(begin[row], begin[row + 1])
        rim.force, rim.before = of_all.force[own], of_all.velocity[own]
        watch.growth.before, watch.growth.size = of_all.before[own], of_all.size[row]
        watch.power.awaited, watch.power.verdict = of_all.awaited[row], of_all.verdict[row]
    return of_all


def _paths(rims):
    """Paths (K,2) [m] of all rims since the last exchange in one array; those of the rims become views of it."""
    path, first = np.concatenate([rim.path for rim in rims]), 0
    for rim in rims:
        rim.path = path[first : first + len(rim.nodes)]
        first += len(rim.nodes)
    return path


def _after(course, steps):
    """The Course after `steps` of its steps."""
    gravity, factor, share = course.gravity[steps:], course.factor[steps:], course.share[steps:]
    first, done = course.first + steps, course.done + steps
    return course._replace(gravity=gravity, factor=factor, share=share, first=first, done=done)
