"""A coupled step over a LAN of two machines (scripts/lan.py): both servers in network namespaces, the line delays each way."""

import subprocess
import sys
from statistics import median

import lan

from bench.coupled_step import coupled, measured_steps, stages_of, with_measured_stages, written
from bench.links import Machines, exchanges
from bench.timing_rows import row
from coupler_protocol.scene.reader import build_scene
from coupler_protocol.scene.stage_kinds import number_of
from coupler_protocol.wire import keys

DELAYS = (1e-4, 5e-4, 2e-3)  # [s] one way
EVERY = 10  # steps from one exchange to the next, where they are not in every step
SECONDS = 1.0  # of a measured pair of stages, about
FORMS = {
    "encrypted link": {"link": {"lane": False}},
    "lane": {"link": {"lane": True}},
    f"encrypted link, exchange_every = {EVERY}": {"link": {"lane": False}, "coupling": {"exchange_every": EVERY}},
}
LONGEST = 600  # [s] of a run


def machines_of(line):
    """Where the ends of an exchange run: the continuum on machine a."""
    return Machines(line.a.words([]), line.b.words([]), line.a.address)


def round_trip(line, delay, nodes, repeats):
    """Seconds of the bare round trip with the checks of a lane, and the same over the encrypted link."""
    count = max(int(0.4 / (2.0 * delay + 2e-4)), 20)
    return [
        exchanges(way, [nodes], count, repeats, machines_of(line))[nodes][0]["seconds"]
        for way in ("raw asleep", "encrypted link")
    ]


def run_over(line, scene, out, begun, folder):
    """Both servers through `scene`, one on each machine; begun: DIR@STAGE from which they continue, folder: of the keys."""
    path = written(scene, out)
    common = [path, "--out", out, "--quiet", "--from", begun]
    grid = [sys.executable, "-P", "-m", "fdm_server", *common, "--bind", f"tcp://{line.a.address}:0", "--keys", folder / "keys"]
    discs = [
        sys.executable, "-P", "-m", "dem_server", *common, "--connect", out / "endpoint", "--rank", 1, "--key", folder / "lan.key"
    ]  # fmt: skip
    ends = []
    try:
        for machine, words in ((line.a, grid), (line.b, discs)):
            ends.append(subprocess.Popen(machine.words(words)))
        codes = [end.wait(LONGEST) for end in ends]
    finally:
        for end in ends:
            end.kill()
            end.wait()
    if any(codes):
        raise SystemExit(f"the servers on both machines ended with {codes}")


def steps_of(delay, every):
    """Steps of the shorter stage of a pair, so that both take about SECONDS."""
    return max(int(SECONDS / (6.0 * ((2.0 * delay + 4e-4) / every + 3e-4))), 2 * every)


def changed(original, change):
    """The scene `original` with `change` in its tables."""
    data = original.model_dump(mode="json", exclude_none=True)
    for table, values in change.items():
        data[table] = {**data.get(table, {}), **values}
    return build_scene(data)


def origin_of(scene, out):
    """DIR@STAGE of the end of the couple stage, which the scene has reached in `out`, or now does on one machine."""
    if not out.exists():
        coupled(with_measured_stages(scene, 1, 0, settled=1), out)
    return f"{out}@{scene.stage[number_of(scene.stage, couples=True)].name}"


def coupled_over(line, delay, scene, repeats, origin, folder):
    """(seconds a step of each pair of stages, last row of run.json) of a scene from its `origin_of` on."""
    every = scene.coupling.exchange_every
    run_over(line, with_measured_stages(scene, steps_of(delay, every), repeats, 20 * every), folder, origin, folder.parent)
    return measured_steps(folder), stages_of(folder)[-1]


def rows_of_lan(original, begun, folder, nodes, sides, repeats, companion):
    """Rows of all delays and forms; begun: directory of a run that came to the end of the couple stage.

    sides: seconds of the grid and of the discs alone, {"kernels": (grid, discs), "one by one": (grid, discs)}.
    """
    keys.new(folder / "keys", "lan", folder / "lan.key")
    rows = []
    for delay in DELAYS:
        with lan.Lan(delay) as line:
            raw, encrypted = (median(seconds) for seconds in round_trip(line, delay, nodes, repeats))
            for name, change in FORMS.items():
                scene = changed(original, change)
                every = scene.coupling.exchange_every
                origin = origin_of(scene, begun if "coupling" not in change else folder / f"begun {every}")
                seconds, stage = coupled_over(line, delay, scene, repeats, origin, folder / f"{delay:g} {name}")
                grid, discs = sides["kernels" if stage.get("plain_steps") else "one by one"]
                bound = max(grid, discs) + raw if every == 1 else grid + discs + raw / every
                size = {"rim_nodes": nodes, "delay_ms": 1e3 * delay}
                rows.append(
                    row(f"coupled step over a LAN, {name}", size, seconds, "s/step", companion)
                    | {"bound": bound, "round_trip": raw, "round_trip_encrypted": encrypted, "exchange_every": every}
                    | {key: stage[key] for key in ("exchanges", "fell_back", "plain_steps", "one_by_one") if key in stage}
                )
    return rows
