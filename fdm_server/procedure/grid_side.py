"""The procedure on the side of the continuum, which conducts the stages of the scene in order."""

import logging
from pathlib import Path

import numpy as np

from coupler_protocol.exits import PeerLost
from coupler_protocol.files import proof
from coupler_protocol.files.kept import value_of
from coupler_protocol.files.recorder import FrameInfo, Recorder
from coupler_protocol.files.restart import END, INSIDE, begins_after, check_plugin, filled, kept, part_file, read
from coupler_protocol.files.run_json import read as read_json
from coupler_protocol.files.run_json import stage_rows
from coupler_protocol.files.saved_moments import is_last, of_side, prune, run_of
from coupler_protocol.process.checkpoint_clock import CheckpointClock
from coupler_protocol.process.plugin import Moment
from coupler_protocol.process.trace import stopwatch
from coupler_protocol.scene import run_number
from coupler_protocol.scene.changes import changes_anything, in_stage
from coupler_protocol.scene.local_origin import local
from coupler_protocol.scene.schedule import large_strain, leg_of
from coupler_protocol.wire import messages
from coupler_protocol.wire.handshake import Choice, welcome_all
from fdm_server.coupling.band_reached import bin_length
from fdm_server.coupling.plain_steps import PlainSteps
from fdm_server.coupling.rim import Rim
from fdm_server.coupling.rim_growth import RimWatch
from fdm_server.coupling.rim_stretch import StretchWatch
from fdm_server.coupling.rim_traction import traction_difference
from fdm_server.effects import law_from
from fdm_server.ground.excavation import excavations, held_in_stages
from fdm_server.ground.initial_stress import initial_state
from fdm_server.mesh.grid import build_grid
from fdm_server.model import build_model
from fdm_server.observe import fields, record
from fdm_server.observe.energy_growth import EnergyWatch
from fdm_server.observe.energy_ledger import Ledger
from fdm_server.observe.stable_limit import safe_limits
from fdm_server.procedure import restart, soundness
from fdm_server.procedure.kinds import KINDS
from fdm_server.procedure.stage_run import StageRun
from fdm_server.run import run_stage
from fdm_server.step.present_shape import begin_large_strain

log = logging.getLogger(__name__)


class ContinuumSide:
    """The grid, its rims and the progress through the stages."""

    compiled = None  # a coupler_protocol.compiled.ahead.Compiled

    def __init__(self, scene, hub, out, progress, origin=None, plugin=None, checkpoint=None):
        self.scene = scene = local(scene)
        self.hub, self.out, self.progress, self.origin = hub, Path(out), progress, origin
        self.plugin = plugin
        self.watch = stopwatch(scene.record.trace)
        self.grid = build_grid(scene)
        self.model = build_model(scene, self.grid)
        self.state = initial_state(scene, self.model)
        self.rims = [Rim(self.grid, window, hub.conversations[rank]) for rank, window in enumerate(scene.window, start=1)]
        self.excavations = excavations(scene, self.grid, held_in_stages(scene, self.grid), self.rims)
        self.recorded = _recorded_histories(scene) if changes_anything(scene) else None
        self.bin_length = bin_length(scene, self.grid)
        self.coupled = False
        self.gravity = 0.0, 1.0  # [m/s2], and its factor, at the end of the last stage
        self.steps = 0
        self.time = 0.0  # [s]; static steps count as 1
        self.earlier = []  # rows of run.json of the stages before `origin`
        self.results = []
        self.stage = None  # StageRun of the present stage
        self.warnings = []  # of all stages so far
        self.recorder = None
        self.farewells = {}
        self.moments = of_side(scene, self.out, restart.NAME, origin)
        self.run_number = run_of(self.out, self.moments)
        progress.name_run(self.run_number)
        self.source = None  # the checkpoint from which this side continues
        self.inside = None  # of a stage: what StageRun.saved gave
        self.written = []  # paths of checkpoints, those of the sides' last common moment first
        seconds = scene.record.checkpoint if checkpoint is None else checkpoint
        self.clock = CheckpointClock(seconds, scene.record.checkpoint_steps)

    @property
    def session(self):
        """Session of the conversations, 0 without discs."""
        return self.rims[0].talk.conversation.session if self.rims else 0

    def run(self):
        """Computes all remaining stages; returns the reason for the end."""
        reason = "all stages done"
        moment = self._welcome()
        self._restore(moment)
        if moment is not None and is_last(self.scene, moment):
            self._take_leave(reason)
            return reason
        path = part_file(self.out, restart.NAME)
        about = kept(self.scene, self.source, path, self.run_number)
        with Recorder(path, "continuum", self.scene.title, about, axis=self.scene.time_axis) as self.recorder:
            begin = self._begin()
            for index, stage in enumerate(self.scene.stage):
                if index >= begin:
                    self.watch.begin(stage.name)
                    done, past = (value_of(self.inside, key) for key in ("done", "time")) if self.inside else (0, 0.0)
                    self.progress.begin(stage, self.steps - done, past)
                    self.stage = StageRun(self, index, stage, leg_of(stage, *self.gravity))
                    if self.inside is None:
                        self.stage.begin_changes()
                    KINDS[stage.kind](self, self.stage)
                    self.stage = None
            if self.coupled:
                self.farewells = {rim.talk.rank: rim.talk.send_stop(reason) for rim in self.rims}
        if self.scene.record.trace is not None:
            self.watch.write(self.out / f"{restart.NAME}.trace.csv")
        return reason

    def _welcome(self):
        """Welcomes the discs; returns the moment from which both sides continue, or None."""

        def needs(moment):
            return filled(self.scene, moment.stage)

        newest = next(iter(self.moments), None)
        self._all_saved = newest is not None and is_last(self.scene, newest)
        if not self.rims or (self._all_saved and all(path.exists() for path in self._discs_said().values())):
            return newest
        try:
            rims = {rim.talk.rank: rim.xy for rim in self.rims}
            surfaces = {rim.talk.rank: rim.surface for rim in self.rims if rim.surface is not None}
            return welcome_all(self.hub, self.scene, rims, Choice(list(self.moments), needs, self.run_number), surfaces)
        except PeerLost:
            if not self._all_saved:
                raise
            return newest  # the discs have nothing to compute either

    def _discs_said(self):
        """Paths {rank: path} at which discs that share this folder leave what they say at their end."""
        return {rim.talk.rank: self.out / f"dem.rank{rim.talk.rank}.json" for rim in self.rims}

    def _take_leave(self, reason):
        """Ends a run that was killed between the end of its last stage and run.json."""
        if self.hub.transport is not None and all(rim.talk.conversation.session for rim in self.rims):
            for rim in self.rims:
                rim.receive_ready()
                rim.talk.send_go(self.gravity[0] * self.gravity[1], self.steps, self.time, self.source.index, self.bin_length)
            self.farewells = {rim.talk.rank: rim.talk.send_stop(reason) for rim in self.rims}
        else:
            said = {rank: path for rank, path in self._discs_said().items() if path.exists()}
            self.farewells = {rank: read_json(path)["farewell"] for rank, path in said.items()}

    def _restore(self, moment):
        """Restores this side at a moment; None: it begins at the start."""
        if moment is None:
            return
        path = self.moments[moment]
        self.source = read(self.scene, path, restart.NAME, moment.stage)
        check_plugin(self.source.about, path, self.plugin)
        restart.restore(self, self.source)
        self.written = [path]
        log.info("continues from %s: %s", path, moment.as_text(self.scene))
        self.progress("start", f"continues from {moment.as_text(self.scene)}", now=True)

    def _begin(self):
        """Begins with the discs where both sides continue; returns the number of the first stage."""
        if not self.source:
            return 0
        index = self.source.index
        if not self.source.is_of(self.out):  # else an earlier part has the frame
            self.frame(self.source.about["stage"], self.source.about["gravity_factor"])
        for rim in self.rims if filled(self.scene, index) else ():
            rim.receive_ready()
        number = index if self.inside else index + 1
        done = value_of(self.inside, "done") if self.inside else 0
        for rim in self.rims if self.coupled else ():
            gravity = leg_of(self.scene.stage[number], *self.gravity).at(done)
            rim.talk.send_go(gravity, self.steps, self.time, number, self.bin_length)
        return number

    def compute(self, stage):
        """Takes the steps of a stage."""
        inside, self.inside = self.inside, None
        self.prepare(stage, inside)
        run_stage(self, stage)

    def prepare(self, stage, inside=None):
        """Prepares model, State and the watches of a stage for its steps; inside: what StageRun.saved gave inside of it."""
        if inside is None:
            stage.set_clock()
            if large_strain(self.scene, stage.stage):
                begin_large_strain(self.model, self.state)
            stage.begin_sides()
            stage.set_loads()
        stage.energy = EnergyWatch(self.model, self.state, stage.gravity, stage.rims, stage.warn)
        if stage.rims:
            stage.stretch = StretchWatch(self.model, np.concatenate([rim.nodes for rim in stage.rims]))
        coupling = self.scene.coupling
        kept_power = coupling.mapping != "paper" and coupling.exchange_every == 1
        stage.interface = [RimWatch(rim, stage.record.history, kept_power, stage.warn) for rim in stage.rims]
        stage.ledger = Ledger(self.model, self.state) if self.scene.record.energy else None
        if inside is not None:
            with proof.of_file(self.source.path):
                stage.restore(inside)
        stage.plain = PlainSteps(self, stage) if stage.rims else None
        if inside is not None and stage.plain:
            stage.plain.taken = inside["plain_steps"]

    # -- what a stage leaves -----------------------------------------------------------------------------------------

    def record(self, stage, order):
        """Records histories and frames, and calls the plugin, by the flags of `order`.

        The last frame of a stage of the grid alone is left to `finish`: what the stage does after its last step belongs to it.
        """
        if self.steps % stage.record.history == 0:
            values = record.history(self.model, self.state, stage.ratio, order.gravity_factor)
            values |= record.reactions(self.model, self.state, stage.leg.gravity * order.gravity_factor, stage.sides.holders)
            values |= record.movements(self.model, self.state, stage.sides.holders)
            values |= {"time": self.time} if self.state.in_real_time else {}
            self.recorder.history(self.steps, **values)
        if int(order.flags) & messages.RECORD and (stage.rims or not stage.ended):
            self.frame(stage.stage.name, order.gravity_factor)
        if self.plugin is not None:
            stage.end_for(self.plugin.step(self._moment(stage), soundness.check))
        if int(order.flags) & messages.CHECKPOINT and not stage.ended:
            self._save_inside(stage)

    def _save_inside(self, stage):
        """Writes a checkpoint inside of a stage and removes old ones; ends the run if it is asked to stop."""
        self.clock.begins(self.steps)
        self.recorder.sync()
        self.written.append(self.save(stage.stage.name, INSIDE, stage.factor))
        prune(self.out, restart.NAME, self.written)
        self.hub.stop.check()

    def _moment(self, stage):
        return Moment(0, stage.stage.name, self.steps, self.model, self.state, self.scene.origin)

    def frame(self, name, factor):
        """Writes one frame."""
        info = FrameInfo(self.steps, self.time, name, factor)
        self.recorder.frame(info, **record.frame(self.model, self.state, self.recorded))

    def finish(self, stage, instead=None):
        """Stores the result of a stage and saves the State; `instead`: State for the next stage if this one is discarded."""
        if not stage.rims:
            self.frame(stage.stage.name, stage.factor)
        stage.check_rest()
        result = stage.result()
        if self.coupled:
            stress = fields.stress(self.model, self.state)
            result["traction_difference"] = [traction_difference(self.model, self.state, rim, stress) for rim in self.rims]
            nodes = np.concatenate([rim.nodes for rim in self.rims])
            sums = np.concatenate([rim.sums for rim in self.rims])
            result["limits"] = safe_limits(self.model, self.state, nodes, sums)
        if self.plugin is not None:
            self.plugin.stage(self._moment(stage), soundness.check)
        stage.end_motions()
        self.results.append(result)
        self.state = self.state if instead is None else instead
        stage.end_changes()
        if not stage.stage.discard:
            self.gravity = stage.leg.gravity, stage.factor
        self.clock.begins(self.steps)
        self.recorder.sync()  # a run that continues from the checkpoint needs all frames before it
        self.save(stage.stage.name, END, stage.factor)
        self.watch.add_to("recording")
        log.info("stage %s", result)
        self.progress(stage.stage.name, f"done: {result['ended_by']}", self.steps, None, stage.ratio, stage.factor, now=True)
        if stage.index + 1 < len(self.scene.stage):
            self.hub.stop.check()

    def rows(self, unfinished=()):
        """Rows of run.json of all completed stages, and of those `unfinished`."""
        results = [*self.results, *unfinished]
        continuum = [times.as_dict() for times in self.watch.stages][: len(results)]
        return self.earlier + stage_rows(results, continuum, [f.get("stages", []) for f in self.farewells.values()])

    def summary(self):
        """Content of run.json: stages so far, and the reports of the discs."""
        return {
            **(begins_after(self.source) if self.source else {}),
            "run": run_number.as_text(self.run_number),
            "steps": self.steps,
            "gridpoints": len(self.grid.xy),
            "zones": len(self.grid.zones),
            **({"computed_about": list(self.scene.origin)} if any(self.scene.origin) else {}),
            "stages": self.rows([self.stage.outcome()] if self.stage and len(self.results) < len(self.watch.stages) else []),
            **({"warnings": self.warnings} if self.warnings else {}),
            **(self.compiled.report() if self.compiled else {}),
            "windows": [
                {"name": rim.window.name, "rank": rim.talk.rank, "control_nodes": len(rim.nodes)}
                | rim.report
                | {k: v for k, v in self.farewells.get(rim.talk.rank, {}).items() if k not in ("stages", "report")}
                for rim in self.rims
            ],
        }

    def save(self, stage, phase, factor=0.0):
        """Writes the State to its checkpoint file; returns the path."""
        return restart.save(self, stage, phase, factor)


def _recorded_histories(scene):
    """Histories {name: History} of all laws that act in any stage: every frame has the same fields."""
    return {name: h for index in range(len(scene.stage)) for name, h in law_from(in_stage(scene, index)).histories.items()}
