"""The coupled run is one leap-frog, to the bit, regardless of messages, processes and restarts.

The quick slope (configs/quick_slope.toml, shortened), coupled in static mode, then in real time with 1.2 g at once and without
damping. From the States at the end of the static stage a plain loop, without messages and without overlap, takes the steps of
the next one: all forces, all velocities, all positions, all new forces. Its gridpoints, zones, discs and contacts are those of
the program, whose sides compute at the same time, in one process or two, in one run or resumed from the end of a stage. Rows
count arrays with different bits."""

import json
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path
from types import SimpleNamespace

import numpy as np

import colluvium
from coupler_protocol.files import checkpoint
from coupler_protocol.files.restart import Origin, load
from coupler_protocol.process.interrupt import StopRequest
from coupler_protocol.process.progress import Progress
from coupler_protocol.wire.clocks import Clocks
from coupler_protocol.wire.lockstep import Hub
from dem_server.procedure import restart as disc_restart
from dem_server.step import clock as disc_clock
from dem_server.step.contact_pass import contact_forces
from dem_server.step.motion import move_free
from fdm_server.coupling import common_step
from fdm_server.procedure import restart as grid_restart
from fdm_server.procedure.grid_side import ContinuumSide
from fdm_server.step import clock as grid_clock
from fdm_server.step.gridpoint_pass import update_velocities
from fdm_server.step.zone_pass import advance
from verification.verdict_rows import row

NAME = "same bits"
SOURCE = "identity (one leap-frog)"
SCENE = Path(__file__).resolve().parents[3] / "configs" / "quick_slope.toml"
GRID, DISCS = "fdm.rank0", "dem.rank1"
STEPS, FACTOR = 150, 1.2


def tables():
    """Tables of the scene."""
    data = tomllib.loads(SCENE.read_text(encoding="utf-8"))
    data["stage"][0]["until"] = {"steps": 400}
    data["stage"][2] |= {"handover": 100, "until": {"steps": 200}}
    real = {"kind": "overload", "time": "real", "damping": {"local": 0.0}}
    data["stage"][3:] = [{"name": "sway", "gravity_factor": FACTOR, "until": {"steps": STEPS}} | real]
    return data


def one_loop(scene, folder):
    """State of the grid and of the discs after the last stage, taken from the end of the one before by a plain loop."""
    origin, stage = Origin(folder, "couple"), scene.stage[-1]
    hub = Hub(None, [1], Clocks(scene.link), StopRequest())
    side = ContinuumSide(scene, hub, folder, Progress(0, "none"), origin)
    grid_restart.restore(side, load(scene, origin, GRID))
    model, grid, rim = side.model, side.state, side.rims[0]
    window = SimpleNamespace(scene=scene)
    disc_restart.restore(window, load(scene, origin, DISCS), rim.xy)
    discs, ring, gravity = window.state, window.rim, 9.81 * FACTOR

    model = grid_clock.begin(model, grid, stage.damping, grid_clock.STEP_FACTOR)
    disc_model = disc_clock.begin_coupled(window.model, discs, scene.discs, stage)
    inner = ring.inner_mass(discs)
    grid.added_mass[rim.nodes] = inner
    rim.sums = ring.stiffness_sums(disc_model, discs)
    rim.answer = rim.answer._replace(dt_limit=discs.next_dt)
    model = common_step.set_common_step(model, grid, [rim])
    discs.next_dt, kick = grid.dt, 0.5 * grid.dt
    for _ in range(STEPS):
        force = ring.nodal_forces(discs)
        grid.applied[rim.nodes] = force
        grid.applied[rim.nodes, 1] -= gravity * inner
        update_velocities(model, grid, gravity, kick)
        move_free(disc_model, discs, gravity)
        ring.move(discs, grid.velocity[rim.nodes])
        advance(model, grid)
        contact_forces(disc_model, discs)
        kick = None
    return grid, discs


def others(found, state):
    """Names of the arrays of a State that differ in a bit from the fields of a checkpoint."""
    names = []
    for name, value in found.items():
        own = getattr(state, name)
        if isinstance(value, dict):
            names += [f"{name}.{inner}" for inner in others(value, own)] if not isinstance(own, dict) else []
        elif value is not None and np.asarray(value).tobytes() != np.asarray(own).tobytes():
            names.append(name)
    return names


def differing(one, two, stage="sway"):
    """How many arrays of the checkpoints of a stage differ between two runs."""
    count = 0
    for name in (GRID, DISCS):
        a, b = (flat(checkpoint.load(Path(folder) / f"{name}.{stage}.h5")[0]) for folder in (one, two))
        count += len(a.keys() ^ b.keys())
        count += sum(np.asarray(a[key]).tobytes() != np.asarray(b[key]).tobytes() for key in a.keys() & b.keys())
    return count


def flat(fields, path=""):
    """Arrays and numbers of nested fields by their paths."""
    found = {}
    for name, value in fields.items():
        found |= flat(value, f"{path}{name}.") if isinstance(value, dict) else {path + name: value}
    return found


def launched(scene_file, out, *options):
    """Run a scene as a user would."""
    command = [sys.executable, "-m", "colluvium.cli", "run", str(scene_file), "--out", str(out), "--quiet", *options]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise ArithmeticError(done.stderr)
    return out


def rows(fast):
    """The loop, two processes and a restart (fast: the loop, for both mappings)."""
    for mapping in ("work-consistent", "paper"):
        with tempfile.TemporaryDirectory() as name:
            folder, data = Path(name), tables() | {"coupling": {"mapping": mapping}}
            scene = colluvium.Scene(**data)
            colluvium.run(scene, folder / "one").close()
            grid, discs = one_loop(scene, folder / "one")
            found = [checkpoint.load(folder / "one" / f"{side}.sway.h5")[0] for side in (GRID, DISCS)]
            wrong = others(found[0]["grid"], grid) + others(found[1]["discs"], discs)
            yield row(f"{mapping} mapping: lock-step against one loop, {STEPS} steps", len(wrong), 0.0, 0.0, SOURCE)
            if fast:
                continue
            file = folder / "scene.json"
            file.write_text(json.dumps(data), encoding="utf-8")
            two = launched(file, folder / "two")
            yield row(f"{mapping} mapping: two processes against one", differing(folder / "one", two), 0.0, 0.0, SOURCE)
            again = launched(file, folder / "again", "--from", f"{folder / 'one'}@couple")
            yield row(f"{mapping} mapping: from a stage's end on", differing(folder / "one", again), 0.0, 0.0, SOURCE)
