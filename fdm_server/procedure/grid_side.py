"""The procedure on the side of the continuum, which conducts the stages of the scene in order."""

import logging
from pathlib import Path

import numpy as np

from coupler_protocol.files.recorder import FrameInfo, Recorder
from coupler_protocol.files.restart import END, filled, kept_stages, load, part_file
from coupler_protocol.files.run_json import stage_rows
from coupler_protocol.process.plugin import Moment
from coupler_protocol.process.trace import stopwatch
from coupler_protocol.scene.changes import changes_anything, in_stage
from coupler_protocol.scene.local_origin import local
from coupler_protocol.scene.schedule import large_strain, leg_of
from coupler_protocol.wire import messages
from coupler_protocol.wire.handshake import resume_from, welcome_all
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
from fdm_server.model import build_model, new_state
from fdm_server.observe import fields, record
from fdm_server.observe.energy_growth import EnergyWatch
from fdm_server.observe.energy_ledger import Ledger
from fdm_server.observe.stable_limit import safe_limits
from fdm_server.procedure import restart
from fdm_server.procedure.kinds import KINDS
from fdm_server.procedure.stage_run import StageRun
from fdm_server.run import run_stage
from fdm_server.step.present_shape import begin_large_strain

log = logging.getLogger(__name__)


class ContinuumSide:
    """The grid, its rims and the progress through the stages."""

    compiled = None  # a coupler_protocol.compiled.ahead.Compiled

    def __init__(self, scene, hub, out, progress, origin=None, plugin=None):
        self.scene = scene = local(scene)
        self.hub, self.out, self.progress, self.origin = hub, Path(out), progress, origin
        self.plugin = plugin
        self.watch = stopwatch(scene.record.trace)
        self.grid = build_grid(scene)
        self.model = build_model(scene, self.grid)
        self.state = initial_state(scene, self.model) if origin is None else new_state(self.model)
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
        self.saved = None if origin is None else load(scene, origin, restart.NAME)
        if self.saved:
            restart.restore(self, self.saved)

    @property
    def session(self):
        """Session of the conversations, 0 without discs."""
        return self.rims[0].talk.conversation.session if self.rims else 0

    def run(self):
        """Computes all remaining stages; returns the reason for the end."""
        about = {} if self.origin is None else {"kept_stages": kept_stages(self.scene, self.origin)}
        path = part_file(self.scene, self.out, restart.NAME, self.origin)
        with Recorder(path, "continuum", self.scene.title, about, axis=self.scene.time_axis) as self.recorder:
            begin = self.connect_discs()
            for index, stage in enumerate(self.scene.stage):
                if index >= begin:
                    self.watch.begin(stage.name)
                    self.stage = StageRun(self, index, stage, leg_of(stage, *self.gravity))
                    self.stage.begin_changes()
                    KINDS[stage.kind](self, self.stage)
                    self.stage = None
            reason = "all stages done"
            if self.coupled:
                self.farewells = {rim.talk.rank: rim.talk.send_stop(reason) for rim in self.rims}
        if self.scene.record.trace is not None:
            self.watch.write(self.out / f"{restart.NAME}.trace.csv")
        return reason

    def connect_discs(self):
        """Welcomes the discs; if this run continues another, restores both sides. Returns the number of the first stage."""
        index = self.saved.index if self.saved else -1
        there = bool(self.saved) and filled(self.scene, index)
        if self.rims:
            resume = resume_from(self.origin.stage, self.saved.about["session"] if there else 0) if self.saved else None
            welcome_all(self.hub, self.scene, {rim.talk.rank: rim.xy for rim in self.rims}, resume)
        if self.saved and not self.origin.continues(self.out):  # in the directory of its origin, an earlier part has the frame
            self.frame(self.origin.stage, self.saved.about["gravity_factor"])
        for rim in self.rims if there else ():
            rim.receive_ready()
        for rim in self.rims if self.coupled else ():
            gravity = leg_of(self.scene.stage[index + 1], *self.gravity).at(0)
            rim.talk.send_go(gravity, self.steps, self.time, index + 1, self.bin_length)
        return index + 1

    def compute(self, stage):
        """Takes the steps of a stage."""
        self.prepare(stage)
        run_stage(self, stage)

    def prepare(self, stage):
        """Prepares model, State and the watches of a stage for its steps."""
        stage.set_clock()
        if large_strain(self.scene, stage.stage):
            begin_large_strain(self.model, self.state)
        stage.begin_sides()
        stage.set_loads()
        stage.energy = EnergyWatch(self.model, self.state, stage.gravity, stage.rims, stage.warn)
        if stage.rims:
            stage.stretch = StretchWatch(self.model, np.concatenate([rim.nodes for rim in stage.rims]))
        coupling = self.scene.coupling
        kept = coupling.mapping != "paper" and coupling.exchange_every == 1
        stage.interface = [RimWatch(rim, stage.record.history, kept, stage.warn) for rim in stage.rims]
        stage.ledger = Ledger(self.model, self.state) if self.scene.record.energy else None
        stage.plain = PlainSteps(self, stage) if stage.rims else None

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
            self.plugin.step(self._moment(stage))

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
            self.plugin.stage(self._moment(stage))
        self.results.append(result)
        self.state = self.state if instead is None else instead
        stage.end_changes()
        if not stage.stage.discard:
            self.gravity = stage.leg.gravity, stage.factor
        self.recorder.sync()  # a run that continues from the checkpoint needs all frames before it
        self.save(stage.stage.name, END, stage.factor)
        self.watch.add_to("recording")
        log.info("stage %s", result)
        self.progress(stage.stage.name, f"done: {result['ended_by']}", self.steps, None, stage.ratio, stage.factor, now=True)

    def rows(self, unfinished=()):
        """Rows of run.json of all completed stages, and of those `unfinished`."""
        results = [*self.results, *unfinished]
        continuum = [times.as_dict() for times in self.watch.stages][: len(results)]
        return self.earlier + stage_rows(results, continuum, [f.get("stages", []) for f in self.farewells.values()])

    def summary(self):
        """Content of run.json: stages so far, and the reports of the discs."""
        return {
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
