"""One stage while it runs: gravity, hand-over and end."""

import copy
import json
import logging

import numpy as np

from coupler_protocol.files import checkpoint
from coupler_protocol.files.kept import Kept, value_of
from coupler_protocol.scene import rest
from coupler_protocol.scene.changes import after_stage, changes_anything_in, in_stage, record_in, words
from coupler_protocol.scene.ending import Ending
from coupler_protocol.scene.schedule import leg_of, new_boundaries
from coupler_protocol.scene.stage_kinds import of
from coupler_protocol.wire import messages
from fdm_server.coupling import common_step
from fdm_server.coupling.band_reached import BandWatch
from fdm_server.coupling.exchange_pauses import Pace
from fdm_server.ground.boundaries_in_time import NO_PUSH, NOTHING, begin_stage, continued
from fdm_server.ground.load_ramps import ForceRamp
from fdm_server.ground.load_steps import LOOK
from fdm_server.ground.reactions import reactions
from fdm_server.model import State, with_materials
from fdm_server.observe.energy import strain_energy
from fdm_server.step import clock
from fdm_server.step.gridpoint_pass import farthest, unbalanced_ratio
from fdm_server.step.momentum import Momentum
from fdm_server.step.present_shape import masses
from fdm_server.step.safety import check_motion

log = logging.getLogger(__name__)


class StageRun(Kept):
    """One stage while it runs: step count, gravity, hand-over and end."""

    KEPT = ("done", "time", "kick", "_step", "_step_before", "ratio", "ended_by", "_unseen", "_warned")

    def __init__(self, side, index, stage, leg):
        self.side, self.index, self.stage, self.leg = side, index, stage, leg
        self.rims = side.rims if side.coupled else []
        self.load = None  # a fdm_server.ground.load_ramps.ForceRamp if forces change
        self.sides = NOTHING  # actions of boundaries
        self.done = 0
        self.time = 0.0  # [s] since the stage began; static steps count as 1
        self.ledger = None  # a fdm_server.observe.energy_ledger.Ledger if the scene has record.energy
        self.energy = None  # a fdm_server.observe.energy_growth.EnergyWatch
        self.stretch = None  # a fdm_server.coupling.rim_stretch.StretchWatch if there are rims
        self.interface = []  # a fdm_server.coupling.rim_growth.RimWatch of every open window
        self.plain = None  # a fdm_server.coupling.plain_steps.PlainSteps if there are rims
        self.changes = {}  # row of run.json of what the stage changes, if it does
        self.record = record_in(side.scene, index)  # its intervals
        self.before = copy.deepcopy(side.state) if stage.discard else None  # State for the stage after a discarded one
        self._warned = set()
        self.ended = False
        self.momentum = None  # a Momentum with kinetic damping, or if a load of a grid alone waits for rest
        self.kick = None  # [s] time over which forces act in the first step of a coupled real-time stage; None: the whole step
        self._step = self._step_before = 0.0  # [s] agreed with the discs; of the previous real-time stage
        self.ratio = ([1.0] + [row["ratio_continuum"] for row in side.earlier + side.results])[-1]
        self.ended_by = ""
        rows = side.earlier + side.results
        self.pace = Pace(side.scene.coupling.exchange_every, rows[-1].get("fell_back", "") if rows else "")
        self._last_step = self._unseen = False
        self._handover = (stage.handover or 500) if of(stage).couples else 0
        change, sides = stage.excavate or stage.surcharge, new_boundaries(side.scene, index)
        ramps = max(self._handover, leg.over, (change.over or 0) if change else 0, *(b.over or 1 for b in sides), 0)
        self._ending = Ending(stage.until, ramps) if stage.until else None
        self._band = BandWatch(stage.until.band, side.grid) if stage.until and stage.until.band else None
        self._every = self.record.history
        stages = side.scene.stage
        self._next = stages[index + 1] if index + 1 < len(stages) else stage

    def saved(self):
        """What changes in the stage beside the State of the side, for a checkpoint inside of it."""
        found = super().saved() | {"changes": json.dumps(self.changes), "step_factor": self.side.model.step_factor}
        found |= {"before": self.before, "load": self.load and self.load.saved(), "sides": self.sides.saved()}
        found |= {"ending": self._ending.saved(), "momentum": self.momentum and self.momentum.saved()}
        found |= {name: part.saved() for name, part in self._parts().items()}
        found |= {"rims": [rim.saved() for rim in self.rims], "interface": [watch.saved() for watch in self.interface]}
        return found | {"plain_steps": self.plain.taken if self.plain else 0}

    def restore(self, saved):
        """Sets what `saved` gave, in a stage whose objects are those of its start."""
        super().restore(saved)
        self.changes = json.loads(value_of(saved, "changes"))
        before = value_of(saved, "before")
        self.before = None if before is None else checkpoint.rebuild(State, before, "before")
        load, momentum = value_of(saved, "load"), value_of(saved, "momentum")
        self.load = None if load is None else ForceRamp.of(load)
        self.sides = continued(self.side.scene, self.index, self.side.model, value_of(saved, "sides"))
        self._ending.restore(value_of(saved, "ending"))
        if momentum is not None:
            self.momentum = Momentum()
            self.momentum.restore(momentum)
        for name, part in self._parts().items():
            if name in saved or name != "ledger":  # energies may be recorded from now on
                part.restore(value_of(saved, name))
        for kept, name in ((self.rims, "rims"), (self.interface, "interface")):
            for one, own in zip(kept, value_of(saved, name), strict=True):
                one.restore(own)

    def _parts(self):
        """Objects of the stage {name: Kept} with values that change."""
        parts = {"pace": self.pace, "energy": self.energy, "stretch": self.stretch, "ledger": self.ledger}
        return {name: part for name, part in parts.items() if part is not None}

    def begin_changes(self):
        """Changes the materials of the grid, if the stage does; notes all that changes from this stage on."""
        side, scene = self.side, self.side.scene
        if changes_anything_in(self.stage):
            self.changes = {"what": words(scene, self.index)}
        if self.stage.material:
            before = strain_energy(side.model, side.state)
            side.model = with_materials(side.model, side.state, in_stage(scene, self.index))
            self.changes["strain_energy"] = [before, strain_energy(side.model, side.state)]

    def end_motions(self):
        """Ends the motion of sides that shake in this stage only."""
        if self.sides.shaken is not None:
            self.sides.shaken.end(self.side.state)

    def end_changes(self):
        """Gives the grid its materials back after a stage that is discarded."""
        if self.stage.discard and self.stage.material:
            self.side.model = with_materials(self.side.model, self.side.state, after_stage(self.side.scene, self.index))

    @property
    def gravity(self):
        """Gravity [m/s2] of the present step."""
        return self.leg.at(self.done)

    @property
    def factor(self):
        """Gravity factor of the present step, after the last step that of the last."""
        return self.leg.factor(max(0, self.done - self.ended))

    @property
    def share(self):
        """Share of the discs in the rim's forces."""
        return self.share_at(self.done)

    def share_at(self, step):
        """The share in the step with this number (from 0) of the stage."""
        return min(1.0, step / self._handover) if self._handover else 1.0

    def shares(self, first, count):
        """The shares (count,) in the steps from `first` on, with the bits of `share_at`."""
        if first >= self._handover:
            return np.ones(count)
        return np.minimum(1.0, np.arange(first, first + count) / self._handover)

    @property
    def ramps(self):
        """The Ramps of loads that change in this stage."""
        found = [] if self.load is None else [self.load.ramp]
        return found + ([] if self.sides.push is None else [load.ramp for load in self.sides.push.loads])

    @property
    def held(self):
        """The Ramps that have not brought their loads to the end because they wait for rest."""
        return [ramp for ramp in self.ramps if ramp.ratio and not ramp.complete]

    def watch_rims(self, state):
        """Checks the interface for unstable growth and for a mismatch of power."""
        for watch in self.interface:
            watch.check(clock.seconds(state), self.side.steps + 1)

    def warn(self, name, text):
        """Writes a warning to the log and to run.json, once for each name in a stage."""
        if name not in self._warned:
            self._warned.add(name)
            log.warning("step %d of stage %s: %s: %s", self.side.steps, self.stage.name, name, text)
            self.side.warnings.append({"stage": self.stage.name, "step": self.side.steps, "name": name, "text": text})

    def order(self):
        """Order for the present step; its `interval` is 0 if no VELOCITY follows the step."""
        dt = clock.seconds(self.side.state)
        self.ended_by = self.ended_by or self._ending.out_of_steps(self.done + 1) or self._ending.out_of_time(self.time + dt, dt)
        self._last_step = bool(self.ended_by)
        number = self.side.steps + 1
        flags = 0
        if self._last_step:
            flags = messages.END_OF_STAGE | messages.RECORD | messages.CHECKPOINT
        elif number % self.record.every == 0:
            flags = messages.RECORD | (messages.STRAIN if self._band else 0)
        following = self.leg.at(self.done + 1)
        if self._last_step:
            following = leg_of(self._next, self.leg.gravity, self.leg.factor(self.done)).at(0)
        if self.rims:
            self.pace.note_velocities(self.rims, self.side.state.velocity)
        interval = self.pace.due(number, must=flags != 0)
        if not self._last_step and (interval or not self.rims) and self.checkpoint_due(number):
            flags |= messages.CHECKPOINT
        return messages.Order(self.index, number, following, self.leg.factor(self.done), dt, float(interval), flags)

    def checkpoint_due(self, number):
        """Whether a checkpoint is due after the step with this number of the run."""
        stop = self.side.hub.stop.asked or any(rim.answer.stop for rim in self.rims)
        return self.side.clock.due(number, stop)

    def observe(self, model, state):
        """Checks, every few steps, the motion, the ratios of both codes, and whether the next step is the last of the stage.

        In a stage of the grid alone, discs that wait for its end receive PROGRESS.
        """
        if not self.rims:
            self.side.hub.report(self.stage.name, self.done)
        if self._band and self.done and self.side.steps % self.record.every == 0:  # the last step made a frame
            self.ended_by = self.ended_by or self._band.reached(model, state, self.rims)
        looks = self.side.steps % self._every == 0
        if looks:
            self._inspect(model, state)
        if self.pace.judges_now(looks):
            self.note_looks([(self.done, self._ratios(model, state), farthest(state.displacement))])
        self._unseen = bool(self.held) and (self._unseen or self.done % LOOK == 0)
        if self._unseen and self.pace.fresh:
            self._unseen = False
            for ramp in [ramp for ramp in self.ramps if ramp.waits]:
                ramp.see(max(self._ratios(model, state)))

    def _inspect(self, model, state):
        check_motion(model, state)
        self.energy.check(model, state, self.gravity)
        self._say(self.stretch.check(state.displacement) if self.stretch else "")
        if self.ledger:
            self.ledger.note(self.side.steps, model, state)
            self.side.recorder.histories(*self.ledger.histories(self.ledger.book, bool(self.rims)))

    def note_looks(self, looks):
        """Takes note of what looks have found: steps done, ratios of both codes, that of the grid first, largest displacement."""
        waiting = bool(self.held)
        for done, ratios, displacement in looks:
            self.ended_by = self.ended_by or self._ending.reached(done + 1, ratios, displacement, waiting)
        self.ratio = ratios[0]
        self.side.progress(self.stage.name, "", done, self.stage.until.steps, max(ratios), self.factor)

    def judge_plain_step(self, looked):
        """Judges what compiled code has noticed in the middle of a plain step; looked: whether histories have a point there."""
        side = self.side
        for watch in self.interface:
            watch.judge()
        if looked:
            check_motion(side.model, side.state)
            self.energy.judge(side.model, side.state)
            self._say(self.stretch.judge())

    def _say(self, warning):
        if warning:
            log.warning("step %d of stage %s: %s", self.side.steps, self.stage.name, warning)

    def end_for(self, reason):
        """Makes the next step the last one of the stage, for a reason; "": it goes on."""
        self.ended_by = self.ended_by or reason

    def check_rest(self):
        """Warns if the stage should have come to rest and its steps or time were used up before."""
        if self._ending is not None and self._ending.at_limit:
            ratio = max(self.ratio, *(rim.answer.ratio for rim in self.rims), 0.0)
            text = rest.shortfall(self.side.scene, self.index, self.ended_by, ratio, self.side.plugin)
            if text:
                self.warn(rest.NAME, text)

    def _ratios(self, model, state):
        """Unbalanced ratios of the grid and of the discs of every window."""
        return [unbalanced_ratio(model, state, self.gravity), *(rim.answer.ratio for rim in self.rims)]

    def set_clock(self):
        """Sets mode and damping of the stage in model and state (fdm_server/step/clock.py)."""
        side, stage = self.side, self.stage
        damping = side.scene.damping if stage.damping is None else stage.damping
        factor = (stage.step_factor or clock.STEP_FACTOR) if stage.in_real_time else None
        self.momentum = Momentum() if damping is not None and damping.kind == "kinetic" else None
        self._step_before = side.state.dt or 0.0
        side.model = clock.begin(side.model, side.state, damping, factor)

    def agree_on_step(self):
        """Sets the common step in the first step of a stage in real time, and checks it in later steps; returns the model.

        Leap-frog: the first forces act for the mean of the steps before and after them, from rest for half a step.
        """
        side, state = self.side, self.side.state
        if not self.rims:
            return side.model
        if not state.in_real_time:
            if self.pace.begins:
                self.pace.note_forces(self.rims, masses(side.model, state))
            return side.model
        if self.done == 0:
            side.model = common_step.set_common_step(side.model, state, self.rims)
            self._step, self.kick = state.dt, 0.5 * (self._step_before + state.dt)
        else:
            self.kick = None
            common_step.check_common_step(side.model, state, self.rims, self._step)
        return side.model

    def begin_sides(self):
        """Lets the boundaries of the stage act; what an excavation or surcharge changes joins their loads."""
        side = self.side
        if self.load is not None:
            self.load.begin(side.state)
        side.model, self.sides = begin_stage(side.scene, self.index, side.model, side.state, self.gravity)
        if self.load is not None and (self.sides.push is not None or self.sides.dashpots):
            push = self.sides.push or NO_PUSH
            self.sides = self.sides._replace(push=push.with_ramp(self.load, side.state))
            self.load = None

    def set_loads(self):
        """Sets the applied forces of the next step, if they change."""
        if self.load is not None:
            self.load.apply(self.side.state)
        if self.sides.push is not None:
            self.sides.push.apply(self.side.state)
        for side in self.sides.dashpots:
            side.apply(self.side.state)
        if self.sides.shaken is not None:
            self.sides.shaken.apply(self.side.state, self.time)

    def set_velocities(self, state):
        """Takes the momentum of a staged relaxation, then sets the velocities that boundaries prescribe in the present step."""
        if self.momentum is None and not self.rims and any(ramp.ratio for ramp in self.ramps):
            self.momentum = Momentum()
        if self.momentum is not None:
            self.momentum.take(self.side.model, state)
        if self.sides.drive is not None:
            self.sides.drive.apply(state, self.done)
        if self.sides.shaken is not None:
            self.sides.shaken.move(state, self.time + 0.5 * clock.seconds(state))

    def step_done(self):
        """Counts the step."""
        self._count(1, clock.seconds(self.side.state))
        for ramp in self.ramps:
            ramp.step_done()
        self.set_loads()
        self.ended = self._last_step

    def plain_steps_done(self, steps):
        """Counts plain steps (fdm_server/coupling/plain_steps.py)."""
        if self.pace.every == 1:
            self.pace.add_exchanges(steps)
        self._count(steps, clock.seconds(self.side.state))

    def times(self, begin, steps):
        """Times [s] after numbers of steps in rising order, summed step by step from `begin`."""
        dt, found, done = clock.seconds(self.side.state), [], 0
        for count in steps:
            for _ in range(count - done):
                begin += dt
            found.append(begin)
            done = count
        return found

    def plain_order(self):
        """Order for the last of the plain steps that are done."""
        done = self.done - 1
        dt = clock.seconds(self.side.state)
        return messages.Order(self.index, self.side.steps, self.leg.at(done + 1), self.leg.factor(done), dt, 1.0, 0)

    @property
    def step_is_known(self):
        """Whether the step of a stage in real time is agreed and has not become too long; always in static mode."""
        real = self.side.state.in_real_time
        return not real or (self.kick is None and 0.0 < self._step <= self.side.state.dt)

    def steps_within_time(self, most):
        """Number of steps, up to `most`, before the last one of a stage that ends by its time."""
        if self.stage.until.time is None:
            return most
        dt = clock.seconds(self.side.state)
        time = self.time
        for step in range(most):
            time += dt
            if time >= self.stage.until.time - 0.5 * dt:
                return step
        return most

    def _count(self, steps, dt):
        self.done += steps
        self.side.steps += steps
        for _ in range(steps):  # as in a sum step by step, bit for bit
            self.time += dt
            self.side.time += dt
        self.side.watch.stages[-1].steps += steps

    def outcome(self):
        """Row of run.json so far; `ended_by` is "" if the stage did not reach its end."""
        return {
            "name": self.stage.name,
            "kind": self.stage.kind,
            "steps": self.done,
            "ended_by": self.ended_by,
            "gravity": self.leg.gravity,
            "gravity_factor": self.factor,
            "seconds_simulated": self.time if self.stage.in_real_time else None,
            "time_step": self.side.state.dt if self.stage.in_real_time else None,
            "ratio_continuum": self.ratio,
            "ratio_discrete": [rim.answer.ratio for rim in self.rims],
            "bonds_broken": [int(rim.answer.broken) for rim in self.rims],
            **({"changes": self.changes} if self.changes else {}),
            **(self.pace.report() if self.rims else {}),
            **(self.stretch.report() if self.stretch else {}),
            **(self.plain.report() if self.plain else {}),
        }

    def result(self):
        """Row of run.json and the closing table at the end of the stage."""
        for ramp in self.held:
            why = f"{ramp.share:.1%} of the load acts at the end of the stage: the ground did not come to rest under it (ratio "
            why += f"{ramp.ratio:g}); more steps help if the ratio falls, else the ground bears no more"
            self.warn("load not complete", why)
        gravity = self.leg.at(max(0, self.done - 1))
        return self.outcome() | {"reactions": reactions(self.side.model, self.side.state, gravity, self.sides.holders)}
