"""The procedure as the continuum conducts it: each stage of the scene in its turn."""

import copy
import logging
from pathlib import Path

from coupler_protocol import checkpoint, messages
from coupler_protocol.handshake import welcome_all
from coupler_protocol.recorder import FrameInfo, Recorder
from coupler_protocol.runfile import stage_rows
from coupler_protocol.schedule import large_strain, leg_of
from coupler_protocol.timing import Stopwatch
from fdm_server import fields, record
from fdm_server.coupling import Rim, open_windows, traction_difference
from fdm_server.ending import Ending
from fdm_server.grid import build_grid
from fdm_server.model import build_model, new_state
from fdm_server.motion import farthest, unbalanced_ratio
from fdm_server.run import run_stage
from fdm_server.safety import check_motion
from fdm_server.shape import begin_large_strain

log = logging.getLogger(__name__)
COUPLED = ("couple", "overload")


class ContinuumSide:
    """The grid, its rims and the way through the stages."""

    def __init__(self, scene, hub, out, progress):
        self.scene, self.hub, self.out, self.progress = scene, hub, Path(out), progress
        self.watch = Stopwatch()
        self.grid = build_grid(scene)
        self.model = build_model(scene, self.grid)
        self.state = new_state(self.model)
        self.rims = [
            Rim(self.grid, window, hub.conversations[rank]) for rank, window in enumerate(scene.window, start=1)
        ]
        self.coupled = False
        self.gravity = 0.0, 1.0  # [m/s2], and the factor it is multiplied by, as the last stage left them
        self.steps = 0
        self.results = []
        self.recorder = None
        self.farewells = {}

    def run(self):
        """All stages; returns the reason for the end."""
        with Recorder(self.out / "fdm.rank0.vtkhdf", "continuum", self.scene.title) as self.recorder:
            if self.rims:
                welcome_all(self.hub, self.scene, {rim.conversation.rank: rim.xy for rim in self.rims})
            for index, stage in enumerate(self.scene.stage):
                self.watch.begin(stage.name)
                if large_strain(self.scene, stage):
                    begin_large_strain(self.model, self.state)
                run = StageRun(self, index, stage, leg_of(stage, *self.gravity))
                KINDS[stage.kind](self, run)
                if not stage.discard:
                    self.gravity = run.leg.gravity, run.factor
            reason = "all stages done"
            if self.coupled:
                self.farewells = {rim.conversation.rank: rim.say_stop(reason) for rim in self.rims}
        return reason

    # -- kinds of stages ---------------------------------------------------------------------------------------------

    def equilibrium(self, stage):
        """The grid alone comes to rest; displacements count from there."""
        run_stage(self, stage)
        self.state.displacement[:] = 0.0
        self.state.velocity[:] = 0.0
        self.finish(stage)

    def locate(self, stage):
        """The grid alone under other gravity; where `discard` is set, nothing of it stays."""
        before = copy.deepcopy(self.state) if stage.stage.discard else None
        run_stage(self, stage)
        self.finish(stage)
        if before is not None:
            self.state = before

    def fill(self, stage):
        """Every window's discs take over the stress of their zones."""
        for rim in self.rims:
            rim.hear_packed()
            field = fields.zone_field(self.model, self.state, rim.mask)
            rim.say_field(field, stage.gravity, stage.stage.insitu is not False)
        for rim in self.rims:
            rim.hear_ready()
            log.info("rank %d: %s", rim.conversation.rank, rim.report)
        self.watch.to("waiting")
        self.finish(stage)

    def couple(self, stage):
        """Windows become holes, discs take over gradually."""
        self.model, self.state = open_windows(self.model, self.state, self.rims)
        for rim in self.rims:
            rim.say_go(stage.gravity, self.steps, stage.index)
        self.coupled = True
        stage.rims = self.rims
        run_stage(self, stage)
        self.finish(stage)

    def overload(self, stage):
        """Gravity grows; coupled if windows are open."""
        run_stage(self, stage)
        self.finish(stage)

    # -- what a stage leaves -----------------------------------------------------------------------------------------

    def record(self, stage, order):
        """Histories and frames, as `order` says."""
        if self.steps % self.scene.record.history == 0:
            self.recorder.history(self.steps, **record.history(self.model, self.state, stage.ratio, order.gravity_factor))
        if int(order.flags) & messages.RECORD:
            self.frame(stage.stage.name, order.gravity_factor)
        if int(order.flags) & messages.CHECKPOINT:
            self.save(stage.stage.name)

    def frame(self, name, factor):
        """Write one frame."""
        info = FrameInfo(self.steps, float(self.steps), name, factor)
        self.recorder.frame(info, **record.frame(self.model, self.state))

    def finish(self, stage):
        """Book the outcome of a stage; stages of the grid alone get their frame and checkpoint here."""
        if not stage.rims:
            self.frame(stage.stage.name, stage.factor)
            self.save(stage.stage.name)
        result = stage.result()
        if self.coupled:
            stress = fields.stress(self.model, self.state)
            result["traction_difference"] = [
                traction_difference(self.model, self.state, rim, stress) for rim in self.rims
            ]
        self.watch.to("recording")
        self.results.append(result)
        log.info("stage %s", result)
        self.progress(stage.stage.name, f"done: {result['ended_by']}", self.steps, None, stage.ratio, stage.factor, now=True)

    def summary(self):
        """Stages for run.json, as far as they got, and what the discs reported."""
        continuum = [times.as_dict() for times in self.watch.stages][: len(self.results)]
        discrete = [farewell.get("stages", []) for farewell in self.farewells.values()]
        return {
            "steps": self.steps,
            "gridpoints": len(self.grid.xy),
            "zones": len(self.grid.zones),
            "stages": stage_rows(self.results, continuum, discrete),
            "windows": [
                {"name": rim.window.name, "rank": rim.conversation.rank, "control_nodes": len(rim.nodes)}
                | rim.report
                | {k: v for k, v in self.farewells.get(rim.conversation.rank, {}).items() if k not in ("stages", "report")}
                for rim in self.rims
            ],
        }

    def save(self, stage, phase="end of step"):
        """Write State to its checkpoint file; returns the path."""
        path = self.out / f"fdm.rank0.{stage}.h5"
        about = {"step": self.steps, "stage": stage, "phase": phase, "scene": self.scene.digest()}
        checkpoint.save(path, self.state, about)
        return path


KINDS = {
    "equilibrium": ContinuumSide.equilibrium,
    "locate": ContinuumSide.locate,
    "fill": ContinuumSide.fill,
    "couple": ContinuumSide.couple,
    "overload": ContinuumSide.overload,
}


class StageRun:
    """One stage while it runs: its step count, gravity, handover and end."""

    def __init__(self, side, index, stage, leg):
        self.side, self.index, self.stage, self.leg = side, index, stage, leg
        self.rims = side.rims if side.coupled else []
        self.done = 0
        self.ended = False
        self.ratio = side.results[-1]["ratio_continuum"] if side.results else 1.0
        self.ended_by = ""
        self._last_step = False
        self._handover = (stage.handover or 500) if stage.kind == "couple" else 0
        self._ending = Ending(stage.until, max(self._handover, leg.over)) if stage.until else None
        self._every = side.scene.record.history
        stages = side.scene.stage
        self._next = stages[index + 1] if index + 1 < len(stages) else stage

    @property
    def gravity(self):
        """Gravity [m/s2] of the present step."""
        return self.leg.at(self.done)

    @property
    def factor(self):
        """Gravity factor of the present step (after the last one: of the last)."""
        return self.leg.factor(max(0, self.done - self.ended))

    @property
    def share(self):
        """Share of the discs in the rim's forces."""
        return min(1.0, self.done / self._handover) if self._handover else 1.0

    def order(self):
        """Scalars of VELOCITY for the present step."""
        self.ended_by = self.ended_by or self._ending.out_of_steps(self.done + 1)
        self._last_step = bool(self.ended_by)
        number = self.side.steps + 1
        flags = 0
        if self._last_step:
            flags = messages.END_OF_STAGE | messages.RECORD | messages.CHECKPOINT
        elif number % self.side.scene.record.every == 0:
            flags = messages.RECORD
        following = self.leg.at(self.done + 1)
        if self._last_step:
            following = leg_of(self._next, self.leg.gravity, self.leg.factor(self.done)).at(0)
        return messages.Order(self.index, number, following, self.leg.factor(self.done), 1.0, 1.0, flags)

    def look(self, model, state):
        """Every few steps: sanity, ratios of both codes, and whether the next step is to be the stage's last."""
        if self.side.steps % self._every:
            return
        self.side.hub.stop.check()  # stages of the grid alone wait for nobody who would ask
        check_motion(model, state)
        self.ratio = unbalanced_ratio(model, state, self.gravity)
        ratios = [self.ratio, *(rim.answer.ratio for rim in self.rims)]
        displacement = farthest(state.displacement)
        self.ended_by = self.ended_by or self._ending.reached(self.done + 1, ratios, displacement)
        self.side.progress(self.stage.name, "", self.done, self.stage.until.steps, max(ratios), self.factor)

    def step_done(self):
        """Count the step."""
        self.done += 1
        self.side.steps += 1
        self.side.watch.stages[-1].steps += 1
        self.ended = self._last_step

    def result(self):
        """Outcome for run.json and the closing table."""
        return {
            "name": self.stage.name,
            "kind": self.stage.kind,
            "steps": self.done,
            "ended_by": self.ended_by,
            "gravity_factor": self.factor,
            "ratio_continuum": self.ratio,
            "ratio_discrete": [rim.answer.ratio for rim in self.rims],
            "bonds_broken": [int(rim.answer.broken) for rim in self.rims],
        }
