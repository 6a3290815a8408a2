"""What a coupled step costs beside its parts: kernels alone, the wire alone, and all of it coupled.

    python scripts/bench_exchange.py [SCENE] [--set KEY=VALUE] [--steps N] [--repeats R] [--beside B] [--json FILE]

Runs SCENE (default configs/paper_slope.toml) to the end of its couple stage in two processes, and goes on for R pairs of stages
of N and 5 N coupled steps at rest without frames: a coupled step is the difference of a pair over 4 N, without what a stage costs
once (its last frame and checkpoint, the start of a process). It then loads both checkpoints and times on the same states

    kernels of a side    its steps in one compiled call, nothing exchanged
    a side alone         its steps one by one, with the Python between its kernels
    wire                 the same bytes there and back between two compiled loops, nothing computed
    link                 the same messages over ZeroMQ

The bound of a coupled step is the kernels of the slower side and the wire. `--beside B`: with B busy processes. Then such pairs
with the scene's frames and without, in turns, all from the end of the couple stage: by what share recording stalls the loop. A
triad in the same run says what the memory of this machine gave. Medians; seconds of wall time.
"""

import argparse
import json
import socket
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path
from statistics import median

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from bench.timing_rows import repeated, row, triad, write

from colluvium.running import processes
from coupler_protocol.compiled.jit import jit
from coupler_protocol.compiled.lane import HERE, put, take
from coupler_protocol.files import checkpoint
from coupler_protocol.interface.ring import build_ring
from coupler_protocol.process.interrupt import StopRequest
from coupler_protocol.scene.reader import build_scene, read_scene
from coupler_protocol.scene.scene import Link
from coupler_protocol.scene.stage_kinds import number_of
from coupler_protocol.wire import link_tcp, messages
from coupler_protocol.wire.clocks import Clocks
from coupler_protocol.wire.frames import StepFrame
from coupler_protocol.wire.lanes import EARLIEST, Lanes, Peer
from coupler_protocol.wire.lockstep import Conversation
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
    scene_file = out / "bench.toml"
    out.mkdir(exist_ok=True)
    scene_file.write_text(processes.as_toml(scene.model_dump(mode="json", exclude_none=True)), encoding="utf-8")
    processes.checked(processes.run_files(scene_file, out, len(scene.window), ["--quiet", *options]))
    rows = {row["name"]: row for row in json.loads((out / "run.json").read_text(encoding="utf-8"))["stages"]}
    pairs = [(row, rows["long" + name.removeprefix("short")]) for name, row in rows.items() if name.startswith("short")]
    return [(_seconds(long) - _seconds(short)) / (long["steps"] - short["steps"]) for short, long in pairs]


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


@jit(package="fdm_server", cache=False)
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


def kernels_of_discs(scene, out, steps, repeats):
    """Seconds a step of the discs of rank 1 in one compiled call, with the ring held."""
    saved = checkpoint.rebuild(WindowState, checkpoint.load(out / "dem.rank1.couple.h5")[0])
    gravity = scene.stage[0].gravity
    call = repeated(lambda: dem_cycle.advance(saved.model, saved.discs, gravity, steps), 1, repeats)
    return [seconds / steps for seconds in call]


@jit(package="fdm_server", cache=False)
def lane_trips(wire, trips, answers):
    """Frames there and back; `answers`: this end waits first. Returns the trips that were made."""
    for trip in range(trips):
        if answers and take(wire, 0) != HERE:
            return trip
        if not put(wire, 0) or (not answers and take(wire, 0) != HERE):
            return trip
        wire.sequence[0] += 1
    return trips


def wire_trips(nodes, steps, repeats):
    """Seconds of a round trip of the same bytes over a lane between compiled loops of two processes."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = str(listener.getsockname()[1])
        child = subprocess.Popen([sys.executable, __file__, "--lane", port, str(nodes), str(steps * (repeats + 1))])
        try:
            lanes = Lanes(1, [Peer(1, 1, nodes)], messages.FORCE, messages.VELOCITY)
            lanes.open(1, listener.accept()[0])
            lane_trips(lanes.wire, 0, True)
            lanes.sockets[0].setblocking(True)
            lanes.sockets[0].sendall(b"!")
            lanes.sockets[0].setblocking(False)

            def call():
                if lane_trips(lanes.wire, steps, True) != steps:
                    raise SystemExit("the other end of the lane has gone")

            return [seconds / steps for seconds in repeated(call, 1, repeats)]
        finally:
            child.wait(60)


def lane_end(port, nodes, trips):
    """The other end of `wire_trips`."""
    lanes = Lanes(1, [Peer(0, 1, nodes)], messages.VELOCITY, messages.FORCE)
    lane_trips(lanes.wire, 0, False)
    connection = socket.create_connection(("127.0.0.1", port))
    connection.recv(1)
    lanes.open(0, connection)
    lane_trips(lanes.wire, trips, False)


def exchange(nodes, steps, repeats):
    """Seconds a bare round trip: FORCE out, VELOCITY back, between two processes, nothing computed."""
    hub = link_tcp.HubTransport("tcp://127.0.0.1:*")
    child = subprocess.Popen([sys.executable, __file__, "--echo", hub.endpoint, str(nodes), str(steps * repeats + 50)])
    try:
        talk, force, velocity = _ends(hub, 1, nodes)
        while True:
            received = hub.receive(5.0)
            if received is not None:
                hub.admit(received[0], 1)
                break

        def trip():
            velocity.scalars[:] = 0.0
            talk.send_step(velocity)
            force.accept(talk.receive((messages.FORCE,))[1])

        trip()
        return repeated(trip, steps, repeats)
    finally:
        child.terminate()
        child.wait()
        hub.close()


def _ends(transport, peer, nodes):
    talk = Conversation(transport, 1, peer, Clocks(Link()), StopRequest())
    force = StepFrame(messages.FORCE, 0, 1, len(messages.Answer._fields), 3 * nodes)
    return talk, force, StepFrame(messages.VELOCITY, 0, 1, len(messages.Order._fields), 2 * nodes)


def echo(endpoint, nodes, turns):
    """The other end of `exchange`."""
    transport = link_tcp.RankTransport(endpoint)
    talk, force, velocity = _ends(transport, 0, nodes)
    for _ in range(turns + 1):
        talk.send_step(force)
        velocity.accept(talk.receive((messages.VELOCITY,))[1])
    talk.send_step(force)
    time.sleep(5.0)


@contextmanager
def busy_processes(count):
    """While this lasts, `count` processes keep a processor busy each."""
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for process in busy:
            process.kill()
            process.wait()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", nargs="?", default=Path(__file__).parent.parent / "configs" / "paper_slope.toml")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="overrides a key of the scene")
    parser.add_argument("--steps", type=int, default=2000)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--json", metavar="FILE")
    parser.add_argument("--beside", type=int, default=0, metavar="B", help="busy processes beside (default 0)")
    parser.add_argument("--echo", nargs=3, help=argparse.SUPPRESS)
    parser.add_argument("--lane", nargs=3, type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.lane:
        return lane_end(*options.lane)
    if options.echo:
        return echo(options.echo[0], int(options.echo[1]), int(options.echo[2]))

    original = read_scene(options.scene, options.set)
    scene = with_measured_stages(original, options.steps, options.repeats, EARLIEST + 100)  # plain steps are compiled in it
    with tempfile.TemporaryDirectory() as name, busy_processes(options.beside):
        folder, begun = Path(name), Path(name) / "begun"
        together = coupled(scene, begun)
        kernels = [kernels_of(scene, begun, options.steps, options.repeats) for kernels_of in (kernels_of_grid, kernels_of_discs)]
        grid = continuum_alone(scene, begun, options.steps, options.repeats)
        discs = discs_alone(scene, begun, options.steps, options.repeats)
        turns = in_turns(original, options.steps, options.repeats, begun, folder)
        nodes = json.loads((begun / "run.json").read_text(encoding="utf-8"))["windows"][0]["control_nodes"]
        wire = wire_trips(nodes, options.steps, options.repeats)
        trips = exchange(nodes, options.steps, options.repeats)
    bandwidth = median(triad(options.repeats))
    companion = {"triad_GB_per_s": bandwidth}
    size = {"rim_nodes": nodes}
    rows = [
        row("coupled step", size, together, "s/step", companion, "two processes, nothing recorded"),
        row("kernels of the grid", size, kernels[0], "s/step", companion),
        row("kernels of the discs", size, kernels[1], "s/step", companion),
        row("wire", size, wire, "s", companion, "round trip over a lane"),
        row("grid alone, one by one", size, grid, "s/step", companion),
        row("discs alone, one by one", size, discs, "s/step", companion),
        row("link", size, trips, "s", companion, "round trip over ZeroMQ"),
    ]
    bound = max(rows[1]["value"], rows[2]["value"]) + rows[3]["value"]
    rows.append(row("bound: slower kernels + wire", size, [bound], "s/step", companion))
    rows += [row(f"coupled step, {words}", size, seconds, "s/step", companion, "in turns") for words, seconds in turns.items()]
    ratios = [with_ / without for without, with_ in zip(*turns.values(), strict=True)]
    for r in rows:
        print(f"{r['name']:<38} {1e6 * r['value']:9.1f} us   spread {100 * r['spread']:5.1f} %")
    print(f"coupled / bound {rows[0]['value'] / bound:.2f}; triad {bandwidth:.1f} GB/s")
    note = f"a frame every {original.record.every} steps"
    rows.append(row("coupled step with frames over without", size, ratios, "-", companion, note))
    print(f"recording stalls the loop by {100 * (median(ratios) - 1.0):.1f} % (median of {len(ratios)} turns; {note})")
    if options.json:
        write(rows, options.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
