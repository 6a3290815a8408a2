"""A coupled step of a scene and its parts on the same states: kernels of a side, a side alone; with frames and without."""

import json

import numpy as np

from bench.timing_rows import repeated
from colluvium.running import processes
from coupler_protocol.compiled.jit import jit
from coupler_protocol.files import checkpoint
from coupler_protocol.interface.ring import build_ring
from coupler_protocol.scene.reader import build_scene
from coupler_protocol.scene.stage_kinds import number_of
from dem_server.coupling.rim import Rim
from dem_server.procedure.restart import WindowState
from dem_server.step import contact_pass as dem_contacts
from dem_server.step import cycle as dem_cycle
from dem_server.step import motion as dem_motion
from fdm_server import model as fdm_model
from fdm_server.mesh import grid as fdm_grid
from fdm_server.mesh.window_zones import rim_of, window_zones
from fdm_server.procedure.restart import GridState
from fdm_server.step import gridpoint_pass as fdm_motion
from fdm_server.step import present_shape
from fdm_server.step import zone_pass as fdm_advance

LONGER = 5  # the second stage of a pair over the first


def with_measured_stages(scene, steps, pairs, settled=200, recorded=False):
    """The scene up to its couple stage, then pairs of stages of `steps` and LONGER times as many coupled steps at rest.

    settled: steps of a stage before them, in which kernels are loaded; recorded: frames as the scene asks for them, else
    histories only.
    """
    data = scene.model_dump(mode="json", exclude_none=True)
    last = number_of(scene.stage, couples=True)
    data["stage"] = [*data["stage"][: last + 1], {"name": "settled", "kind": "overload", "until": {"steps": settled}}]
    for i in range(pairs):
        for name, number in (("short", steps), ("long", LONGER * steps)):
            data["stage"].append({"name": f"{name} {i}", "kind": "overload", "until": {"steps": number}})
    if not recorded:
        data["record"] = {"every": 10**9, "history": data["record"]["history"]}
    return build_scene(data)


def coupled(scene, out, options=()):
    """Seconds a step of each measured pair of stages in two processes; options: of the servers."""
    processes.checked(processes.run_files(written(scene, out), out, len(scene.window), ["--quiet", *options]))
    return measured_steps(out)


def written(scene, out):
    """Path of a scene in the directory of its run."""
    out.mkdir(exist_ok=True)
    (out / "bench.toml").write_text(processes.as_toml(scene.model_dump(mode="json", exclude_none=True)), encoding="utf-8")
    return out / "bench.toml"


def measured_steps(out):
    """Seconds a step of each measured pair of stages of a finished run."""
    rows = {row["name"]: row for row in stages_of(out)}
    pairs = [(row, rows["long" + name.removeprefix("short")]) for name, row in rows.items() if name.startswith("short")]
    return [(_seconds(long) - _seconds(short)) / (long["steps"] - short["steps"]) for short, long in pairs]


def stages_of(out):
    """Rows of the stages in run.json."""
    return json.loads((out / "run.json").read_text(encoding="utf-8"))["stages"]


def _seconds(row):
    return sum(row["seconds"][part] for part in ("continuum", "waiting", "recording"))


def in_turns(scene, steps, repeats, begun, folder):
    """Seconds a step without frames and with them, `repeats` each, in turns, all from the end of the couple stage.

    begun: directory of a run that came there without frames.
    """
    without, frames = (with_measured_stages(scene, steps, 1, recorded=recorded) for recorded in (False, True))
    coupled(frames, folder / "frames")
    last = scene.stage[number_of(scene.stage, couples=True)].name
    found = {"without frames": [], "with frames": []}
    for turn in range(repeats):
        for words, kind, origin in zip(found, (without, frames), (begun, folder / "frames"), strict=True):
            found[words] += coupled(kind, folder / f"{words} {turn}", ["--from", f"{origin}@{last}"])
    return found


def cut_grid(scene, out):
    """Model and State of the grid at the end of the couple stage."""
    grid = fdm_grid.build_grid(scene)
    whole = fdm_model.build_model(scene, grid)
    saved = checkpoint.rebuild(GridState, checkpoint.load(out / "fdm.rank0.couple.h5")[0])
    return fdm_model.model_of(grid, saved.zone, whole.density, whole.material_law, whole.fixed), saved.grid


def continuum_alone(scene, out, steps, repeats):
    """Seconds a step of the cut grid on the coupled state, forces of the discs held."""
    model, state = cut_grid(scene, out)
    gravity = scene.stage[0].gravity

    def step():
        fdm_motion.update_velocities(model, state, gravity)
        fdm_advance.advance(model, state)

    return repeated(step, steps, repeats)


def discs_alone(scene, out, steps, repeats):
    """Seconds a step of the discs of rank 1 on the coupled state, with the ring held."""
    grid = fdm_grid.build_grid(scene)
    nodes = grid.xy[rim_of(grid, window_zones(grid, scene.window[0]))]
    saved = checkpoint.rebuild(WindowState, checkpoint.load(out / "dem.rank1.couple.h5")[0])
    model, state = saved.model, saved.discs
    rim = Rim(build_ring(nodes, scene.discs.radius), scene.coupling.mapping, saved.rim)
    still, gravity = np.zeros_like(nodes), scene.stage[0].gravity

    def step():
        rim.nodal_forces(state)
        rim.stiffness_sums(model, state)
        dem_motion.move_free(model, state, gravity)
        rim.move(state, still)
        dem_contacts.contact_forces(model, state)

    return repeated(step, steps, repeats)


@jit(package="fdm_server")
def grid_steps(steps, motion, count, velocity, displacement, strips, zones, effects):
    """Steps of the grid in one call; arguments as of the kernels."""
    force, applied, mass, added_mass, weight_mass, fixed, gravity, damping, half_combined, previous = motion
    mohr_coulomb, tension, softening, plastic, plastic_shear, added, memory, _, _, xy = effects
    for _ in range(steps):
        fdm_motion.velocity_kernel(
            0, count, force, applied, mass, added_mass, weight_mass, fixed, gravity, damping, half_combined, previous,
            None, None, velocity,
        )  # fmt: skip
        fdm_advance.move_kernel(0, count, velocity, None, displacement)
        fdm_advance.zones_kernel(
            0, strips, *zones, mohr_coulomb, tension, softening, plastic, plastic_shear, added, memory, None, None, xy
        )


def kernels_of_grid(scene, out, steps, repeats):
    """Seconds a step of the cut grid in one compiled call, forces of the discs held."""
    model, state = cut_grid(scene, out)
    motion = (
        state.force, state.applied, present_shape.masses(model, state), state.added_mass, model.weight_mass, model.fixed,
        scene.stage[0].gravity, *fdm_motion.resistance(model, state, None)[:3],
    )  # fmt: skip
    zones, effects = fdm_advance.zone_arguments(model, state)
    count, strips = len(state.velocity), len(model.gather.ready) - 2

    def call():
        grid_steps(steps, motion, count, state.velocity, state.displacement, strips, zones, effects)

    return [seconds / steps for seconds in repeated(call, 1, repeats)]


def kernels_of_discs(scene, out, steps, repeats, rank=1):
    """Seconds a step of the discs of a rank in one compiled call, with the ring held."""
    saved = checkpoint.rebuild(WindowState, checkpoint.load(out / f"dem.rank{rank}.couple.h5")[0])
    gravity = scene.stage[0].gravity
    call = repeated(lambda: dem_cycle.advance(saved.model, saved.discs, gravity, steps), 1, repeats)
    return [seconds / steps for seconds in call]
