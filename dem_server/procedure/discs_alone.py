"""Discs alone: a scene without a grid. One process fills the window and computes the stages.

The polygon of the window is filled inside a ring of control discs, and the ring is then removed: only walls hold the discs. Or
the discs are read from a file.
"""

import json
import logging
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from coupler_protocol import exits
from coupler_protocol.files import checkpoint, disc_csv, proof, restart, run_json, saved_moments
from coupler_protocol.files.kept import Kept, value_of
from coupler_protocol.files.recorder import FrameInfo, Recorder
from coupler_protocol.process import server
from coupler_protocol.process.checkpoint_clock import CheckpointClock
from coupler_protocol.process.plugin import Moment
from coupler_protocol.process.trace import Stopwatch
from coupler_protocol.scene import rest, run_number
from coupler_protocol.scene.changes import changes_anything_in, in_stage, record_in, words
from coupler_protocol.scene.ending import Ending
from coupler_protocol.scene.local_origin import about, local_origin
from coupler_protocol.scene.schedule import plan
from dem_server.model import Model, State
from dem_server.observe import energy, record, unbalanced_ratio
from dem_server.observe.measuring import Measuring
from dem_server.observe.sample_strain import mean_strain
from dem_server.packing import alone_window, draw_apart
from dem_server.procedure import stage_changes, walls_of_scene
from dem_server.procedure.proof import prove
from dem_server.step import bonds_made, breaks, clock, cycle
from dem_server.step.contact_pass import contact_forces

log = logging.getLogger(__name__)
NAME = "dem.rank1"
NOTHING = 1e-9  # share of a stage's seconds that may remain at its end


class AloneState(NamedTuple):
    """Everything that changes, and the model, which depends on the packing. time: of all stages so far, 1 for a static step."""

    model: Model
    discs: State
    time: float
    stage: dict[str, Any]  # inside of a stage: what StageAlone.saved gives


class StageAlone(Kept):
    """One stage while it runs: steps done, time with which it began, last ratio, and its Ending."""

    KEPT = ("done", "began", "ratio")

    def __init__(self, stage, leg, began):
        self.stage, self.leg, self.began = stage, leg, began
        self.done, self.ratio = 0, 1.0
        self.ending = Ending(stage.until, leg.over)

    def saved(self):
        """What changes, for a checkpoint inside of the stage."""
        return super().saved() | {"ending": self.ending.saved()}

    def restore(self, saved):
        """Sets what `saved` gave."""
        super().restore(saved)
        self.ending.restore(value_of(saved, "ending"))


class DiscsAlone:
    """The discs of a scene without a grid, and its stages."""

    compiled = None  # a coupler_protocol.compiled.ahead.Compiled

    def __init__(self, scene, out, progress, stop, origin=None, plugin=None, checkpoint=None):
        self.scene, self.out, self.progress, self.stop, self.origin = scene, Path(out), progress, stop, origin
        self.plugin = plugin
        self.watch = Stopwatch()
        self.steps, self.time = 0, 0.0
        self.earlier, self.results, self.report = [], [], {}  # earlier: rows of run.json of the stages before `origin`
        self.changes = {}  # what the present stage changes, for run.json
        self.recorded = stage_changes.recorded_fields(scene)  # of all stages
        self.tested = walls_of_scene.any_moves(scene)  # whether the discs are a sample between moving walls
        self.measuring = None  # the regions in which discs are measured
        self.warnings = []  # of all stages so far
        self.stage = None  # StageAlone of the present stage
        self.inside = None  # of a stage: what StageAlone.saved gave
        self.written = []  # paths of checkpoints, that from which the run continues first
        self.clock = CheckpointClock(scene.record.checkpoint if checkpoint is None else checkpoint, scene.record.checkpoint_steps)
        self.model = self.state = self.recorder = self.stones = None
        self.origin_of_places = np.zeros(2)  # [m] from which model and State count (coupler_protocol.scene.local_origin)
        self.saved = self._newest()

    def run(self):
        """Computes all stages; returns the reason for the end."""
        first = 0
        if self.saved:
            self._restore()
            first = self.saved.index + (not self.inside)
        if first == len(self.scene.stage):
            return "all stages done"  # killed between the end of the last stage and run.json
        path = restart.part_file(self.out, NAME)
        kept = restart.kept(self.scene, self.saved, path, self.run_number)
        legs = plan(self.scene)
        if not self.saved:
            self._enter(self.scene.stage[0], 0)
            self._fill()
            self.watch.add_to("computing")
        self.measuring = Measuring.of_window(about(self.scene, self.origin_of_places), 1)
        if self.measuring and not self.saved:
            self.measuring.refuse_empty(self.state.x)
        constants = record.stones(self.stones.outlines, self.origin_of_places) if self.stones else None
        with Recorder(path, "discrete", self.scene.title, kept, constants, self.scene.time_axis) as self.recorder:
            if not (self.saved and self.saved.is_of(self.out)):  # else an earlier part has the frame
                self._frame(self.saved.about["stage"] if self.saved else self.scene.stage[0].name, 1.0)
            if not self.saved:
                self.results.append(self._row(self.scene.stage[0], legs[0], 0, "", [], 0.0))
                self._end_stage(self.scene.stage[0].name, 1.0)
                first = 1
            for index, (stage, leg) in list(enumerate(zip(self.scene.stage, legs, strict=True)))[first:]:
                self._stage(index, stage, leg)
        return "all stages done"

    # -- stages ------------------------------------------------------------------------------------------------------

    def _fill(self):
        """Makes discs, stones and walls of the scene, and bonds at contacts."""
        begin = time.perf_counter()
        found = disc_csv.read(self.scene.discs.file) if self.scene.discs.file is not None else None
        self.origin_of_places = place = local_origin(self.scene, found and found.xy)
        scene = about(self.scene, place)
        self.model, self.state, self.stones, self.report = alone_window.fill(
            scene, self._note, found and found.counted_from(place)
        )
        self.state.walls = walls_of_scene.walls_of(scene, self.model, self.state)
        contact_forces(self.model, self.state)
        if self.scene.discs.file is not None and not self.scene.stage[1].in_real_time:
            self.model, left = draw_apart.separate_discs(self.model, self.state)
            self.report |= left
        if self.model.law.bond is not None:
            bonds_made.add_bonds(self.model, self.state)
        if self.model.law.parallel_bond is not None:
            bonds_made.add_parallel_bonds(self.model, self.state)
        self.state.origin[:] = self.state.x
        self.report |= {"computed_about": place.tolist()} if place.any() else {}
        self.report |= {"name": NAME, "discs": self.model.count, "packing_seconds": time.perf_counter() - begin}
        log.info("filled %s", self.report)

    def _newest(self):
        """The newest checkpoint from which the run can continue, or None."""
        moments = saved_moments.of_side(self.scene, self.out, NAME, self.origin)
        self.run_number = saved_moments.run_of(self.out, moments)
        self.progress.name_run(self.run_number)
        for moment, path in moments.items():
            found = restart.read(self.scene, path, NAME, moment.stage)
            restart.check_plugin(found.about, path, self.plugin)
            log.info("continues from %s: %s", path, moment.as_text(self.scene))
            self.progress("start", f"continues from {moment.as_text(self.scene)}", now=True)
            return found
        return None

    def _stage(self, index, stage, leg):
        """Computes one stage from its first step, or from that after a checkpoint, to its last."""
        self.stage = run = StageAlone(stage, leg, self.time)
        if self.inside is None:
            walls_of_scene.begin_stage(self.scene, stage, self.model, self.state)
            self._begin_changes(index, stage, in_stage(self.scene, index))
        else:
            self._continue(run)
        self._enter(stage, self.steps - run.done)
        intervals = record_in(self.scene, index)
        every, record_every = intervals.history, intervals.every
        looks = (every, record_every) if self.measuring is None else (every, record_every, intervals.measure)
        ended_by = ""
        while not ended_by:
            chunk = self._chunk(stage, leg, run.done, looks, self.time - run.began)
            self.time += cycle.advance(self.model, self.state, leg.at(run.done), chunk)
            run.done, self.steps = run.done + chunk, self.steps + chunk
            ended_by = run.ending.out_of_steps(run.done)
            ended_by = ended_by or run.ending.out_of_time(self.time - run.began, 2.0 * NOTHING * (stage.until.time or 0.0))
            factor = leg.factor(run.done - 1)
            if self.steps % every == 0 or ended_by:
                run.ratio = self._observe(leg, run.done - 1)
                farthest = float(np.hypot(*self.state.displacement.T).max())
                ratios = [run.ratio, walls_of_scene.servo_error(self.state.walls)]
                ended_by = ended_by or run.ending.reached(run.done, ratios, farthest)
                self.progress(stage.name, "", run.done, stage.until.steps, run.ratio, factor)
            self.watch.stages[-1].steps = run.done
            if self.measuring and (self.steps % intervals.measure == 0 or self.steps % record_every == 0 or ended_by):
                self.recorder.history(self.steps, **self.measuring.values(self.model, self.state))
            self.watch.add_to("computing")
            if self.steps % every == 0 or self.steps % record_every == 0 or ended_by:
                self._look_for_cracks()
            if self.steps % record_every == 0 or ended_by:
                self._frame(stage.name, factor)
            if self.plugin is not None:
                self.plugin.step(self._moment(stage.name))
            if not ended_by and self.clock.due(self.steps, self.stop.asked):
                self._save_inside(stage.name, factor)
        if run.ending.at_limit:
            self._check_rest(stage.name, ended_by, max(ratios))
        self.results.append(self._row(stage, leg, run.done, ended_by, [run.ratio], self.time - run.began))
        self.stage = None
        self._end_stage(stage.name, factor)

    def _enter(self, stage, first):
        """Starts the clock of a stage; first: step of the run before its first one."""
        self.watch.begin(stage.name)
        self.progress.begin(stage, first, self.time - self.stage.began if self.stage else 0.0)

    def _continue(self, run):
        """Continues inside of a stage: model and State are those of its last step."""
        with proof.of_file(self.saved.path):
            run.restore(self.inside)
            self.changes = json.loads(value_of(self.inside, "changes"))
        self.inside = None

    def _save_inside(self, name, factor):
        """Writes a checkpoint inside of a stage and removes old ones; ends the run if it is asked to stop."""
        self.clock.begins(self.steps)
        self.recorder.sync()
        self.written.append(self.save(name, restart.INSIDE, factor))
        saved_moments.prune(self.out, NAME, self.written)
        self.watch.add_to("recording")
        self.stop.check()

    def _check_rest(self, name, ended_by, ratio):
        """Warns if the stage should have come to rest and its steps or time were used up before."""
        index = [stage.name for stage in self.scene.stage].index(name)
        text = rest.shortfall(self.scene, index, ended_by, ratio, self.plugin)
        if text:
            log.warning("step %d of stage %s: %s: %s", self.steps, name, rest.NAME, text)
            self.warnings.append({"stage": name, "step": self.steps, "name": rest.NAME, "text": text})

    def _begin_changes(self, index, stage, now):
        """Sets the model in the stage's mode, with its damping and its changes of the law, and what it changes, for run.json.

        now: the scene in this stage.
        """
        change = stage_changes.begin(self.scene, index, self.model, self.state)
        factor = (stage.step_factor or now.discs.time_step) if stage.in_real_time else None
        model = self.model if change is None else change.model
        self.model = clock.begin(model, self.state, stage.damping or now.discs.damping, factor)
        found = {"what": words(self.scene, index)} if changes_anything_in(stage) else {}
        if change is not None:
            found |= {key: value for key, value in change.complete(self.model, self.state).items() if key != "stage"}
        self.changes = found

    def _chunk(self, stage, leg, done, every, passed):
        """Number of steps until histories, frames, the plugin or a change are due."""
        until = stage.until
        left = min(n - self.steps % n for n in (*every, *self._plugin_steps()))
        if done < leg.over:
            left = 1
        if until.steps is not None:
            left = min(left, until.steps - done)
        if until.time is not None:
            left = min(left, self._steps_within(until.time - passed))
        return left

    def _steps_within(self, seconds):
        """Whole steps within `seconds`, at least 1; the next step is shortened if none fits, so that the stage ends on time."""
        whole = int(seconds / self.state.next_dt)
        if whole == 0:
            self.state.next_dt = seconds
        return max(whole, 1)

    def _plugin_steps(self):
        return () if self.plugin is None or self.plugin.on_step is None else (self.plugin.every,)

    def _moment(self, stage):
        return Moment(1, stage, self.steps, self.model, self.state, tuple(self.origin_of_places.tolist()))

    def _observe(self, leg, step):
        """Records histories; returns the unbalanced ratio. Raises PhysicsFailed if forces are NaN or infinite."""
        gravity, state = leg.at(step), self.state
        ratio = unbalanced_ratio.unbalanced_ratio(self.model, state, gravity)
        if not np.isfinite(ratio):
            raise exits.PhysicsFailed(f"the discs' forces are NaN or infinite after step {self.steps}")
        values = {
            "time": self.time,
            "unbalanced_ratio": ratio,
            "bonds_broken": state.broken_tension + state.broken_shear,
            "kinetic_energy": energy.kinetic(self.model, state),
            "elastic_energy": energy.stored(self.model, state),
            "weight_energy": energy.potential(state, gravity),
            "velocity_caps": state.capped,
        }
        if state.walls is not None:
            values["wall_force_x"], values["wall_force_y"] = state.walls.force.sum(axis=0).tolist()
            values |= walls_of_scene.histories(self.scene, state.walls, self.origin_of_places)
            if self.tested:
                values |= dict(zip(("strain_xx", "strain_yy", "strain_xy"), mean_strain(self.model, state).tolist(), strict=True))
        self.recorder.history(self.steps, **values)
        return ratio

    def _look_for_cracks(self):
        """Records the breaks of bonds since the last look."""
        rows = breaks.take(self.state)
        if rows is not None:
            columns = breaks.as_columns(rows, self.model.material, self.origin_of_places)
            at = np.full(len(rows), self.steps), np.full(len(rows), self.time)
            self.recorder.cracks({"step": at[0], "time": at[1], **columns})

    # -- what is left behind -----------------------------------------------------------------------------------------

    def _frame(self, stage, factor):
        info = FrameInfo(self.steps, self.time, stage, factor)
        self.recorder.frame(info, **record.frame(self.model, self.state, self.origin_of_places, self.recorded))
        self.watch.add_to("recording")

    def _end_stage(self, name, factor):
        if self.plugin is not None:
            self.plugin.stage(self._moment(name))
        self.clock.begins(self.steps)
        self.recorder.sync()
        self.save(name, restart.END, factor)
        self.watch.add_to("recording")
        if name != self.scene.stage[-1].name:
            self.stop.check()

    def save(self, stage, phase, factor=0.0):
        """Writes the State to its checkpoint file; returns the path."""
        inside = self.stage.saved() | {"changes": json.dumps(self.changes)} if phase == restart.INSIDE else {}
        path = saved_moments.path_of(self.out, NAME, stage, self.steps if inside else 0)
        more = {"report": self.report, "rows": self._rows(not inside), "warnings": self.warnings} | restart.named(self.plugin)
        more["origin"] = self.origin_of_places.tolist()
        about = restart.attributes(self.scene, NAME, stage, phase, self.steps, 0, factor, self.run_number, **more)
        checkpoint.save(path, AloneState(self.model, self.state, self.time, inside), about)
        return path

    def _restore(self):
        """Restores the discs from the checkpoint of the end of a stage."""
        with proof.of_file(self.saved.path):
            found = checkpoint.rebuild(AloneState, self.saved.fields)
            prove(found.model, found.discs)
            walls = 0 if found.discs.walls is None else len(found.discs.walls.ends)
            expected = len(self.scene.discs.wall)
            proof.require(walls == expected, f"it has {walls} walls, the scene {expected}")
            self.report = self.saved.said("report", dict)
            self.earlier, self.warnings = self.saved.said("rows", list), self.saved.said("warnings", list)
            place = np.array(self.saved.said("origin", list), dtype=np.float64)
            proof.require(place.shape == (2,) and np.isfinite(place).all(), f"its origin is {place.tolist()}, not a point")
            self.origin_of_places = place
        self.model, self.state, self.time, inside = found
        self.inside = inside or None
        self.written = [self.saved.path]
        self.steps = int(self.saved.about["step"])
        self.watch.begin(self.saved.about["stage"])

    def _row(self, stage, leg, steps, ended_by, ratios, seconds):
        return {
            "name": stage.name,
            "kind": stage.kind,
            "steps": steps,
            "seconds_simulated": seconds if stage.in_real_time else None,
            "time_step": self.state.dt if stage.in_real_time else None,
            "ended_by": ended_by,
            "gravity": leg.gravity,
            "gravity_factor": leg.factor(steps - 1),
            "ratio_discrete": ratios,
            "bonds_broken": [self.state.broken_tension + self.state.broken_shear],
        } | ({"changes": self.changes} if self.changes else {})

    def _rows(self, also_present=True):
        """Rows of run.json of all completed stages and, if wanted, of the present one."""
        times = [stage.as_dict() for stage in self.watch.stages]
        if self.saved is not None:
            times = times[1:]
        run = self.stage
        results = list(self.results)
        if run is not None and also_present:
            results.append(self._row(run.stage, run.leg, run.done, "", [run.ratio], self.time - run.began))
        return self.earlier + run_json.stage_rows_alone(results, times)

    def summary(self):
        """Content of run.json."""
        warned = {"warnings": self.warnings} if self.warnings else {}
        begin = restart.begins_after(self.saved) if self.saved else {}
        compiled = self.compiled.report() if self.compiled else {}
        begin |= {"run": run_number.as_text(self.run_number)}
        return begin | {"stages": self._rows(), "windows": [self.report] if self.report else []} | warned | compiled

    def _note(self, text, fraction=None):
        """Reports the progress of a long phase; raises Interrupted if a stop was requested."""
        self.stop.check()
        self.progress(self.scene.stage[0].name, text if fraction is None else f"{text} {100 * fraction:.0f} %")


def compute(scene, context):
    """Computes a scene without a grid; writes run.json in any case, and the State if the run fails.

    context: a coupler_protocol.process.server.RunContext.
    """

    def side():
        return DiscsAlone(scene, *context)

    server.conduct_run(side, scene, context)
