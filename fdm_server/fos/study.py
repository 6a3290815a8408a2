"""The factor of a scene on one mesh or several: trials, frames, and fos.json."""

import logging
import time
from pathlib import Path

from coupler_protocol.exits import PhysicsFailed
from coupler_protocol.files import run_json
from coupler_protocol.files.recorder import FrameInfo, Recorder
from coupler_protocol.problems import unfit
from coupler_protocol.scene.changes import after_stage
from coupler_protocol.scene.local_origin import local
from coupler_protocol.scene.rules.between_tables import listed_doubts
from fdm_server.fos import bracket as bracketing
from fdm_server.fos import flow_rule
from fdm_server.fos.extrapolation import extrapolate
from fdm_server.fos.ground import damping_of, settle, with_zone_size, zone_size
from fdm_server.fos.loading import driven
from fdm_server.fos.reduction import rules
from fdm_server.fos.trial import run_trial
from fdm_server.fos.verdict import criterion
from fdm_server.mesh.grid import build_grid
from fdm_server.observe import record

log = logging.getLogger(__name__)
QUANTITY = {"strength": "factor of safety", "gravity": "gravity factor at collapse"}
NEAR = 1.03  # a finer mesh begins with the coarser one's bracket, widened by this


class Study:
    """The search on all meshes of a scene, which leaves its files in the folder `out`."""

    def __init__(self, scene, out, progress, stop):
        self.digest = scene.digest()
        self.scene = after_stage(scene, len(scene.stage) - 1)  # with the materials that its stages leave
        self.out, self.progress, self.stop = Path(out), progress, stop
        self.meshes, self.doubts = [], []

    def run(self):
        """All meshes, coarse to fine; returns the content of fos.json, which is written after every trial."""
        begin = time.perf_counter()
        table = self.scene.fos
        sizes = sorted(table.zone_sizes or [zone_size(self.scene)], reverse=True)
        first = table.bracket
        for number, size in enumerate(sizes, start=1):
            self._mesh(number, len(sizes), size, first)
            first = self.meshes[-1]["low"] / NEAR, self.meshes[-1]["high"] * NEAR
        self._write(begin)
        return self.summary(begin)

    def summary(self, begin):
        """Content of fos.json so far."""
        done = [m for m in self.meshes if "value" in m]
        found = {"seconds": round(time.perf_counter() - begin, 3), "meshes": self.meshes}
        if len(done) > 1:
            half = [0.5 * (m["high"] - m["low"]) for m in done]
            found["extrapolation"] = extrapolate([m["zone_size"] for m in done], [m["value"] for m in done], half).as_dict()
        table = self.scene.fos
        return {
            "title": self.scene.title,
            "scene_hash": self.digest,
            "quantity": QUANTITY[table.by],
            "rules": {"flow": flow_rule.in_words(self.scene)} | rules(table),
            "criterion": criterion(table),
            "ignored": ignored(self.scene),
            "doubts": self.doubts,
            "damping": damping_of(self.scene).model_dump(exclude_none=True),
            "about": run_json.describe(self.scene),
        } | found

    def _write(self, begin):
        run_json.write_json(self.out / "fos.json", self.summary(begin))

    def _mesh(self, number, of, size, first):
        """The search on one mesh; its frames go to the folder meshN."""
        begin = time.perf_counter()
        scene, name = self._scene(size), f"mesh {number}/{of}"
        for doubt in listed_doubts(scene):
            log.warning("%s: %s: %s; %s", name, *doubt.values())
            self.doubts.append({"mesh": number} | doubt)
        say = self._say(f"{name}: settling")
        here = local(scene)
        ground = settle(here, self.stop.check, say)
        row = {
            "zone_size": size,
            "zones": len(ground.model.zone),
            "gridpoints": len(ground.model.grid.xy),
            "gravity": ground.gravity,
            "settlement": ground.settlement,
            "settling_steps": ground.steps,
            "span": ground.span,
            "budget": ground.budget,
            "trials": [],
        }
        self.meshes.append(row)
        folder = self.out / f"mesh{number}"
        folder.mkdir(exist_ok=True)
        run_json.write_json(folder / "scene.json", scene.resolved())
        with Recorder(folder / "fdm.rank0.vtkhdf", "continuum", self.scene.title) as recorder:
            steps = 0

            def oracle(factor):
                nonlocal steps
                trial = run_trial(here, ground, factor, self.stop.check, self._say(f"{name}: factor {factor:.5g}"))
                steps += trial.steps
                gravity_factor = factor if scene.fos.by == "gravity" else 1.0
                info = FrameInfo(steps, float(steps), f"{factor:.6g} {trial.verdict}", gravity_factor)
                recorder.frame(info, **record.frame(trial.model, trial.state))
                row["trials"].append(trial.row(ground.span) | {"frame": len(row["trials"])})
                log.info("%s: %s after %d steps", name, info.stage, trial.steps)
                self.progress(name, f"done: factor {factor:.5g} {trial.verdict}", trial.steps, now=True)
                self._write(begin)
                return trial.verdict

            try:
                found = bracketing.search(oracle, first, scene.fos.resolution)
            except bracketing.NoBracket as error:
                raise PhysicsFailed(f"{name}: {error}") from None
        row |= {"value": found.middle, "low": found.low, "high": found.high}
        row |= {"undecided": found.undecided, "contradictions": found.contradictions}
        row["seconds"] = round(time.perf_counter() - begin, 3)

    def _scene(self, size):
        """The scene on a mesh of zones of `size`."""
        if size == zone_size(self.scene):
            return self.scene
        if any(s.excavate is not None and s.excavate.columns is not None for s in self.scene.stage):
            raise unfit("fos.zone_sizes", "an excavation by columns and rows depends on the mesh", "give it as a polygon")
        scene = with_zone_size(self.scene, size).model_copy(
            update={"window": []}
        )  # columns and rows of windows are of the own mesh
        try:
            build_grid(local(scene))
        except ValueError as error:
            raise unfit("fos.zone_sizes", f"{size:g}: {error}", "choose sizes that divide the grid's lengths") from None
        return scene

    def _say(self, stage):
        return lambda steps, ratio: self.progress(stage, "", steps, None, ratio)


def ignored(scene):
    """What of the scene has no part in the search, in words."""
    found = []
    if scene.window:
        found.append(f"{len(scene.window)} window(s) and their discs: only the grid is computed")
    if scene.grid.large_strain or any(s.large_strain for s in scene.stage):
        found.append("large strain: trials compute in the shape drawn")
    if any(s.in_real_time for s in scene.stage):
        found.append("real time: trials are static")
    found += [f"velocity of {name!r}: the side is held" for name in driven(scene)]
    return found
