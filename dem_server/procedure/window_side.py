"""The procedure on the discrete side: join, fill the window, bring it to the slope's stress, couple."""

import logging
import time
from pathlib import Path

import numpy as np

from coupler_protocol.criteria.stable_step import as_text
from coupler_protocol.exits import PeerLost, PhysicsFailed
from coupler_protocol.files import proof
from coupler_protocol.files.checkpoint import attributes
from coupler_protocol.files.kept import Kept, value_of
from coupler_protocol.files.recorder import FrameInfo, Recorder
from coupler_protocol.files.restart import END, INSIDE, filled, kept, part_file, read
from coupler_protocol.files.run_json import peak_memory, write_json
from coupler_protocol.files.saved_moments import is_last, of_side, prune
from coupler_protocol.geometry import spot
from coupler_protocol.process.plugin import Moment
from coupler_protocol.process.trace import stopwatch
from coupler_protocol.scene import run_number
from coupler_protocol.scene.changes import in_stage, record_in
from coupler_protocol.scene.local_origin import in_the_scene
from coupler_protocol.scene.of_window import of_window
from coupler_protocol.scene.schedule import plan
from coupler_protocol.scene.stage_kinds import number_of
from coupler_protocol.wire import messages, payloads
from coupler_protocol.wire.frames import content_of
from coupler_protocol.wire.handshake import join
from dem_server import run
from dem_server.coupling.grid_talk import GridTalk
from dem_server.coupling.plain_steps import PlainSteps
from dem_server.coupling.ring_guard import RingGuard
from dem_server.coupling.window_strain import WindowStrain, bins_over_box
from dem_server.insitu.takeover import take_over
from dem_server.observe import energy, record, stable_limit, unbalanced_ratio
from dem_server.observe.energy_ledger import Ledger
from dem_server.observe.measuring import Measuring
from dem_server.observe.not_finite import first_not_finite
from dem_server.packing.coupled_window import drawn_stones, packed_window
from dem_server.procedure import restart, soundness, stage_changes
from dem_server.procedure.compile_ahead import coupled_kernels
from dem_server.procedure.load_ahead import libraries
from dem_server.step import breaks, clock, guards
from dem_server.step.motion import SPEED_CAP
from dem_server.stones import bodies

log = logging.getLogger(__name__)
MOST_BINS = 1e6  # for strain: a FORCE with more of them would not fit into a frame
TOO_FAST = (
    "move by more than a tenth of the smallest radius a step in stage {!r} after step {}: give the stage a smaller step_factor, "
    "or less violent loads"
)


class DiscreteSide(Kept):
    """One window, its discs and its conversation with the continuum."""

    compiled = None  # a coupler_protocol.compiled.ahead.Compiled
    KEPT = ("gravity", "time", "step", "substeps", "power")

    def __init__(self, scene, rank, conversation, out, progress, origin=None, plugin=None):
        self.scene = scene = of_window(scene, rank)
        self.rank, self.conversation, self.plugin = rank, conversation, plugin
        self.out, self.progress, self.origin = Path(out), progress, origin
        self.watch = stopwatch(scene.record.trace)
        self.answer = self.looked = messages.Answer(1.0, *[1.0] + [0.0] * 6)  # with the next FORCE, and after it
        self.gravity = 0.0  # [m/s2] of the next step
        self.run_number = 0  # of WELCOME
        self.steps, self.time = 0, 0.0  # time [s]; static steps count as 1
        self.step = 1.0  # [s] agreed with the continuum, 1 in static mode; None: not yet, in a stage in real time
        self.substeps = 1  # of the discs in one of them
        self.power = 0.0  # [W] of the ring in the last step with histories
        self._free_list = -1  # number of the list of pairs in which no disc was going through another one
        self.stage = self.talk = None
        self.ledger = None  # a dem_server.observe.energy_ledger.Ledger if the scene has record.energy
        self.recorder = None
        self.measuring = Measuring.of_window(scene, rank)  # None: the window has no region
        self.report, self.openings, self.limits, self.changes = {}, [], [], []
        self.record_of_stage = scene.record  # its intervals
        self.recorded = stage_changes.recorded_fields(scene)  # of all stages
        self.surface = None  # (S, 2) [m] of WELCOME, for a window that reaches the ground surface
        self.model = self.guard = self.state = self.rim = self.stones = None
        self.moments = of_side(scene, self.out, restart.name(rank), origin)
        self.moment = None  # from which both sides continue
        self.source = None  # the checkpoint from which this side continues
        self.inside = None  # of a stage: what `saved_stage` gave
        self.sent_strain = False  # whether the last FORCE contained strain
        self.written = []  # paths of checkpoints, those of the sides' last common moment first

    # -- the procedure -----------------------------------------------------------------------------------------------

    def run(self):
        """Runs from HELLO to FAREWELL; returns the continuum's reason for the end."""
        joined = join(self.conversation, self.scene, self.moments, None if self.moments else libraries())
        nodes, moment, self.run_number, self.surface = joined
        self.progress.name_run(self.run_number)
        self._find(moment)
        if self.measuring and not self.source:
            self.measuring.refuse_outside(self._outline(nodes))
        self.stones = drawn_stones(self.scene, self.rank, self._outline(nodes), self._note)
        constants = record.stones(self.stones.outlines, self.scene.origin) if self.stones else {}
        constants |= {} if self.surface is None else {"window_surface": in_the_scene(self.surface, self.scene.origin)}
        path = part_file(self.out, restart.name(self.rank))
        about = kept(self.scene, self.source, path, self.run_number)
        with Recorder(path, "discrete", self.scene.title, about, constants or None, self.scene.time_axis) as self.recorder:
            if self.source:
                self.restore_window(nodes)
            else:
                self.fill(nodes)
                self.bring_to_stress()
            self.begin_coupling()
            reason = run.lockstep(self)
        if self.scene.record.trace is not None:
            self.watch.write(self.out / f"{restart.name(self.rank)}.trace.csv")
        summary = self.summary()
        said = {"run": run_number.as_text(self.run_number), "reason": reason, "farewell": summary}
        write_json(self.out / f"{restart.name(self.rank)}.json", said)
        self.conversation.send_control(messages.FAREWELL, summary)
        return reason

    def _find(self, moment):
        """Reads the checkpoint of the moment from which both sides continue. Raises PeerLost for one that was not offered."""
        self.moment = moment
        if moment is None or (moment not in self.moments and not filled(self.scene, moment.stage)):
            return
        if moment not in self.moments:
            raise PeerLost(f"the continuum continues from {moment.as_text(self.scene)}, of which there is no checkpoint here")
        path = self.moments[moment]
        self.source, self.written = read(self.scene, path, restart.name(self.rank), moment.stage), [path]
        log.info("continues from %s: %s", path, moment.as_text(self.scene))
        self.progress("start", f"continues from {moment.as_text(self.scene)}", now=True)

    def restore_window(self, nodes):
        """Restores the window from its checkpoint."""
        self._enter(self.source.index)
        restart.restore(self, self.source, nodes, self.surface)

    def fill(self, nodes):
        """Makes the ring on the rim and a packing inside it; sends PACKED."""
        self._enter(number_of(self.scene.stage, fills=True))
        begin = time.perf_counter()
        self.model, self.state, self.rim, packed = packed_window(
            self.scene, self.rank, nodes, self.stones, self._note, self.surface
        )  # fmt: skip
        self.report = {
            "discs": self.model.count - self.model.ring,
            "control_discs": self.model.ring,
            "packing_seconds": time.perf_counter() - begin,
        } | packed.report()
        if self.stones is not None:
            self.report |= bodies.report(self.model, self.state, self.stones, self._outline(nodes))
        log.info("packed %s", self.report)
        self.watch.add_to("computing")
        self.conversation.send_control(messages.PACKED, self.report)

    def _outline(self, nodes):
        """Corners (P, 2) [m] of the window with its rim at `nodes`."""
        return nodes if self.surface is None else np.concatenate([nodes, self.surface])

    def bring_to_stress(self):
        """Receives FIELD, the stress of the replaced zones; the discs take it over and are bonded."""
        kernels = coupled_kernels(self)
        _, frame = self.conversation.receive((messages.FIELD,), meanwhile=kernels)
        self.watch.add_to("waiting")
        content = content_of(frame)
        field = payloads.field_of(content)
        gravity = content["gravity"]
        self.model, found = take_over(
            self.model, self.state, field, gravity, self.stones, self.scene.stones and self.scene.stones.body,
            self.scene.discs.density_matching, content["insitu"], self._note,
        )  # fmt: skip
        self.report |= {key: _plain(value) for key, value in found.items()}
        self.rim.contacts_changed()
        self.state.origin[:] = self.state.x
        self.answer = self.looked = self._new_answer(gravity)

    def begin_coupling(self):
        """Sends READY and waits for GO; records a frame, and saves a window that was just filled."""
        log.info("ready %s", self.report)
        self.watch.add_to("computing")
        self.conversation.send_control(messages.READY, payloads.ready_content(self.rim.inner_mass(self.state), self.report))
        _, frame = self.conversation.receive((messages.GO,))
        self.watch.add_to("waiting")
        go = content_of(frame)
        self.gravity, self.steps, self.time = go["gravity"], go["step"], float(go["time"])
        self.guard = RingGuard(self.model, self.state, self.scene.origin)
        self._prepare_talk(go.get("bin"))
        name, factor = self._starting_stage()
        if not (self.source and self.source.is_of(self.out)):  # else an earlier part has the frame
            self._frame(FrameInfo(self.steps, self.time, name, factor))
        if not self.source:
            if self.plugin is not None:
                self.plugin.stage(self._moment(name), soundness.check)
            self.recorder.sync()
            self.save(name, END, factor)
        self.watch.add_to("recording")
        if self.source and is_last(self.scene, self.moment):
            self.step, self.stage = None, self.source.index
            self.plain = PlainSteps(self)  # the continuum answers the first FORCE with STOP
        elif self.inside is None:
            self._begin_stage(go["stage"])
        else:
            self._continue_stage(go["stage"])

    @property
    def _filling(self):
        """Name of the stage that fills the window."""
        return self._name_of(number_of(self.scene.stage, fills=True))

    def _starting_stage(self):
        """Stage and gravity factor of the State before the first step."""
        if self.source:
            return self.source.about["stage"], self.source.about["gravity_factor"]
        filled = number_of(self.scene.stage, fills=True)
        return self._name_of(filled), plan(self.scene)[filled].end

    def _prepare_talk(self, bin_length):
        if bin_length is not None and not 0.0 < bins_over_box(self.rim.nodes, bin_length) < MOST_BINS:
            raise PeerLost(f"the continuum wants the strain in bins of {bin_length} m")
        self.strain = None if bin_length is None else WindowStrain(bin_length, self.state, self.model.ring, self.model.surface)
        self.talk = GridTalk(self.conversation, len(self.rim.nodes), self.strain.bins if self.strain else 0)

    def _enter(self, index, first=None):
        """Starts the clock of a stage; first: step of the run before its first one, if that is not the present step."""
        self.watch.begin(self._name_of(index))
        self.progress.begin(self.scene.stage[index], self.steps if first is None else first)

    def _begin_stage(self, index):
        self.stage = index
        self._enter(index)
        now, change = in_stage(self.scene, index), stage_changes.begin(self.scene, index, self.model, self.state)
        self.record_of_stage = record_in(self.scene, index)
        model = self.model if change is None else change.model
        self.model = clock.begin_coupled(model, self.state, now.discs, self.scene.stage[index], change is not None)
        if change is not None:
            self.changes.append(change.complete(self.model, self.state))
            self.rim.contacts_changed()
            stored = energy.stored(self.model, self.state)
            self.answer, self.looked = (a._replace(stored=stored) for a in (self.answer, self.looked))
        real = self.model.in_real_time
        self.step, self.substeps = (None, self.scene.coupling.substeps) if real else (1.0, 1)
        longest = clock.longest_step(self.model, self.state, self.substeps)
        self.answer, self.looked = (a._replace(dt_limit=longest) for a in (self.answer, self.looked))
        self.ledger = Ledger(self.model, self.state) if self.scene.record.energy else None
        self.plain = PlainSteps(self)

    def saved_stage(self):
        """What changes in a stage beside the State, for a checkpoint inside of it."""
        found = self.saved() | {"guard": self.guard.saved(), "sent_strain": self.sent_strain}
        return found | {"ledger": self.ledger and self.ledger.saved()}

    def _continue_stage(self, index):
        """Continues inside of a stage: model and State are those of its last step."""
        if self.source.index != index:
            own = self.source.about["stage"]
            raise PeerLost(f"the continuum continues in stage {self._name_of(index)!r}, this side in {own!r}")
        self.stage = index
        before = next((path for moment, path in self.moments.items() if moment.stage < index and not moment.step), None)
        self._enter(index, before and int(attributes(before)["step"]))
        self.record_of_stage = record_in(self.scene, index)
        self.ledger = Ledger(self.model, self.state) if self.scene.record.energy else None
        with proof.of_file(self.source.path):
            self.restore(self.inside)
            self.guard.restore(value_of(self.inside, "guard"))
            self.sent_strain = value_of(self.inside, "sent_strain")
            if self.ledger and self.inside["ledger"] is not None:
                self.ledger.restore(self.inside["ledger"])
        self.plain = PlainSteps(self)

    def _name_of(self, index):
        if not 0 <= index < len(self.scene.stage):
            raise PeerLost(f"the continuum names stage {index}, which the scene does not have")
        return self.scene.stage[index].name

    def _note(self, text, fraction=None):
        """Progress of a long phase, also for the continuum, and the place where it can be interrupted."""
        self.conversation.stop.check()
        said = text if fraction is None else f"{text} {100 * fraction:.0f} %"
        self.progress(self._filling, said)
        self.conversation.report(said)

    @property
    def answer_now(self):
        """The Answer of the next FORCE; `stop` asks the continuum for a checkpoint, after which this side ends."""
        return self.answer._replace(stop=float(self.conversation.stop.asked))

    # -- called by the loop ------------------------------------------------------------------------------------------

    def accept_order(self, order):
        """Takes length and number of steps from VELOCITY (in real time the first one of a stage sets the length).

        Raises PeerLost for steps that were not agreed.
        """
        _refuse_other_stage(order, self.stage)
        dt, steps = order.dt, order.interval
        most = 1 if self.model.in_real_time else self.scene.coupling.exchange_every
        if not 1 <= steps <= most or order.step != self.steps + steps:
            raise PeerLost(f"the continuum takes {steps:g} steps to step {order.step:g}, after {self.steps} and at most {most}")
        if self.step is None:
            longest = clock.longest_step(self.model, self.state, self.substeps)
            if not 0.0 < dt <= longest:
                raise PeerLost(f"the continuum takes steps of {dt:g} s, the discs can take {longest:g} s")
            self.step, self.model = dt, clock.divided(self.model, self.state, dt, self.substeps)
            self.rim.contacts_changed()
        elif dt != self.step:
            raise PeerLost(f"the continuum takes a step of {dt:g} s, {self.step:g} s were agreed for the stage")

    def gravity_in(self, order):
        """Gravity [m/s2] in the last step of a VELOCITY; `order.gravity` is that of the step after it."""
        return plan(self.scene)[int(order.stage)].gravity * order.gravity_factor if order.interval > 1.0 else order.gravity

    def check_step(self):
        """Raises PhysicsFailed if new contacts have made the agreed step too long for the discs."""
        if self.state.next_dt < self.step / self.substeps:
            raise PhysicsFailed(
                f"the step of {self.step:.4g} s agreed for stage {self._name_of(self.stage)!r} is too long after step "
                f"{self.steps}: the discs' contacts now need {self.substeps * self.state.next_dt:.4g} s; "
                "give the stage a smaller step_factor"
            )

    def refuse_infinite(self, force):
        """Raises PhysicsFailed for nodal forces that are NaN or infinite."""
        if not np.isfinite(force.sum()):
            raise PhysicsFailed(
                f"the discs' forces on the rim are NaN or infinite after step {self.steps}{self._not_finite()}: the window has "
                "blown up; try a smaller step_factor"
            )

    def refuse_fast(self, count):
        """Raises PhysicsFailed if `count` discs or stones were too fast in real time, where no speed is capped."""
        if count and self.model.in_real_time:
            raise PhysicsFailed(f"{count} discs or stones, {self._fastest(slice(self.model.ring, None))}, {self._too_fast()}")

    def refuse_passing(self):
        """Raises PhysicsFailed for discs that go through each other in real time, with every new list of pairs."""
        if self.model.in_real_time and self.state.builds != self._free_list:
            self._free_list = self.state.builds
            try:
                guards.refuse_fast_passing(self.model, self.state)
            except ArithmeticError as error:
                raise PhysicsFailed(f"{error} (stage {self._name_of(self.stage)!r}, after step {self.steps})") from error

    def refuse_fast_rim(self):
        """Raises PhysicsFailed if the grid moves control discs so fast that others could pass through them."""
        model, state = self.model, self.state
        if model.in_real_time and np.abs(state.v[: model.ring]).max() * state.dt > SPEED_CAP * model.smallest_radius:
            raise PhysicsFailed(f"control discs, {self._fastest(slice(0, model.ring))}, {self._too_fast()}")

    def _too_fast(self):
        return TOO_FAST.format(self._name_of(self.stage), self.steps)

    def _fastest(self, discs):
        """The fastest of a slice of the discs in words."""
        number = range(self.model.count)[discs][int(np.nanargmax(np.hypot(*self.state.v[discs].T)))]
        speed, where = np.hypot(*self.state.v[number]), spot(self.state.x[number], self.scene.origin)
        return f"the fastest is disc {number} at {where} with {speed:.3g} m/s"

    def measure_power(self, order):
        """Stores the ring's power in a step with histories, before its contact forces change."""
        if int(order.step) % self.record_of_stage.history == 0:
            self.power = self.rim.power(self.state)

    def book_energy(self, gravity, begins):
        """Books energies after the motion of a step and before its contacts. begins: whether this is the first sub-step."""
        self.ledger.book_motion(self.model, self.state, gravity)
        if begins and self.steps % self.record_of_stage.history == 0:
            self.ledger.note(self.steps, self.model, self.state)
            self.recorder.histories(*self.ledger.histories())
        self.ledger.copy_contacts(self.model, self.state)

    def observe(self, order):
        """Counts the step; at steps with histories computes an Answer and checks the ring."""
        self.count_step(order)
        if self.steps % self.record_of_stage.history == 0:
            self.look(order)

    def count_step(self, order):
        """Counts a step."""
        self.steps = int(order.step)
        self.time += order.dt
        self.watch.stages[-1].steps += 1

    def look(self, order):
        """Computes an Answer and checks the ring after a step with histories."""
        self.looked = self._new_answer(order.gravity)
        self._look_for_cracks()
        self._say(self.guard.check(self.model, self.state))
        self.progress(self._name_of(self.stage), "", self.steps, None, self.looked.ratio, order.gravity_factor)

    def judge_look(self, looked, fresh):
        """Judges what compiled code has noticed in the last look, which found `looked`; fresh: by a new list of pairs."""
        self._refuse_ratio(looked.ratio)
        if fresh:
            self.guard.refuse_lost(self.model, self.state)
        self._say(self.guard.judge())

    def note_looks(self, steps, looks, times, factor):
        """Records histories of several looks of compiled code; times [s]; factor: of the gravity of the last step."""
        self.guard.note_list(self.state)
        self.recorder.histories(steps, self._histories(looks, times))
        self.progress(self._name_of(self.stage), "", steps[-1], None, looks[-1].ratio, factor)

    def _look_for_cracks(self):
        """Records the breaks of bonds since the last look."""
        rows = breaks.take(self.state)
        if rows is not None:
            self.note_cracks(np.full(len(rows), self.steps), [self.time] * len(rows), rows)

    def note_cracks(self, steps, times, rows):
        """Records breaks of bonds: rows (k, 9) of dem_server.step.breaks, steps (k,) and times [s] of their looks."""
        columns = breaks.as_columns(rows, self.model.material, self.scene.origin)
        self.recorder.cracks({"step": steps, "time": np.array(times), **columns})

    def _say(self, warning):
        if warning:
            log.warning("step %d of stage %s: %s", self.steps, self._name_of(self.stage), warning)

    def _refuse_ratio(self, ratio):
        if not np.isfinite(ratio):
            raise PhysicsFailed(f"the discs' forces are NaN or infinite after step {self.steps}{self._not_finite()}")

    def _not_finite(self):
        found = first_not_finite(self.model, self.state, self.scene.origin)
        return f" ({found})" if found else ""

    def _new_answer(self, gravity):
        ratio = unbalanced_ratio.unbalanced_ratio(self.model, self.state, gravity)
        self._refuse_ratio(ratio)
        broken = self.state.broken_tension + self.state.broken_shear
        return messages.Answer(
            ratio=ratio,
            dt_limit=self.looked.dt_limit,
            kinetic=energy.kinetic(self.model, self.state),
            stored=energy.stored(self.model, self.state),
            power=self.power,
            broken=float(broken),
            warnings=float(self.state.capped),
            height=energy.weight_height(self.model, self.state),
        )

    def record(self, order):
        """Writes histories, measures, frames and checkpoints as the Order demands."""
        _refuse_other_stage(order, self.stage)
        self.record_histories()
        flags = int(order.flags)
        name = self._name_of(int(order.stage))
        if flags & messages.RECORD:
            self._look_for_cracks()
            self._frame(FrameInfo(self.steps, self.time, name, order.gravity_factor))
        if self.measuring and (self.steps % self.record_of_stage.measure == 0 or flags & messages.RECORD):
            self.recorder.history(self.steps, **self.measuring.values(self.model, self.state))
        if self.plugin is not None:
            self.plugin.step(self._moment(name), soundness.check)
            if flags & messages.END_OF_STAGE:
                self.plugin.stage(self._moment(name), soundness.check)
        if flags & messages.END_OF_STAGE:
            self._note_limit(name)
            self._note_end()
        if flags & messages.CHECKPOINT:
            self._save_ordered(name, bool(flags & messages.END_OF_STAGE), order.gravity_factor)
        if flags & messages.END_OF_STAGE and int(order.stage) + 1 < len(self.scene.stage):
            self.watch.add_to("recording")
            self._begin_stage(int(order.stage) + 1)

    def _save_ordered(self, name, at_end, factor):
        """Writes the checkpoint that the continuum orders; inside of a stage it ends the run if this side is asked to stop."""
        self.recorder.sync()  # a run that continues from the checkpoint needs all frames before it
        path = self.save(name, END if at_end else INSIDE, factor)
        if not at_end:
            self.written.append(path)
            prune(self.out, restart.name(self.rank), self.written)
            self.conversation.stop.check()

    def record_histories(self):
        """Records histories if they have a point after the present step."""
        if self.steps % self.record_of_stage.history == 0:
            self.recorder.histories([self.steps], self._histories([self.looked], [self.time]))

    def _histories(self, looks, times):
        return {
            "unbalanced_ratio": [look.ratio for look in looks],
            "bonds_broken": [int(look.broken) for look in looks],
            "kinetic_energy": [look.kinetic for look in looks],
            "velocity_caps": [int(look.warnings) for look in looks],
            **({"time": times} if self.model.in_real_time else {}),
        }

    def _note_limit(self, name):
        """Stores the safe limit of the step at the end of a stage, if there is one; sub-steps do not change it (clock.py)."""
        found = stable_limit.safe_limit(self.model, self.state, self.rim, self.scene.origin)
        if found is None:
            return
        if self.substeps > 1:
            found |= {"share": found["share"] / self.substeps, "dt": self.step}
        self.limits.append({"stage": name} | found)
        log.info("stage %s: safe step limit of the discs as a multiple of the step in use: %s", name, as_text(found))

    def _note_end(self):
        """Stores the opening of the ring in the stage that ends, if it caused a warning, and its number of plain steps."""
        self.plain.report()
        found = self.guard.report(self._name_of(self.stage))
        self.openings += [found] if found else []
        self.guard.begin()

    def _moment(self, stage):
        return Moment(self.rank, stage, self.steps, self.model, self.state, self.scene.origin)

    def _frame(self, info):
        self.recorder.frame(info, **record.frame(self.model, self.state, self.scene.origin, also=self.recorded))

    # -- what is left behind -----------------------------------------------------------------------------------------

    def save(self, stage, phase, factor=0.0):
        """Write the State to its checkpoint file; returns the path."""
        return restart.save(self, stage, phase, factor)

    def summary(self):
        """Content of FAREWELL, for run.json."""
        self._note_end()
        return {
            "report": self.report,
            "ring_opened": self.openings,
            "limits": self.limits,
            **({"changes": self.changes} if self.changes else {}),
            "stages": [stage.as_dict() for stage in self.watch.stages],
            "bonds_broken_tension": self.state.broken_tension,
            "bonds_broken_shear": self.state.broken_shear,
            "velocities_capped": self.state.capped,
            "peak_memory_MB": peak_memory(),
            **(self.compiled.report() if self.compiled else {}),
        }


def _plain(value):
    return value.item() if isinstance(value, np.generic) else value


def _refuse_other_stage(order, stage):
    """Raises PeerLost for an Order of another stage than number `stage`."""
    if order.stage != stage:
        raise PeerLost(f"the continuum is in stage number {order.stage:g} of the scene, this side in number {stage}")
