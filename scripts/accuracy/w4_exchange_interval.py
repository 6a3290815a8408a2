"""W4: pauses between exchanges: error, gap, steps, messages and seconds for k = coupling.exchange_every = 1 to 50.

*column*: 4 x 8 m of ground under its weight with a window of 2 x 3 m; *slope*: `configs/quick_slope.toml` with unbreakable bonds,
so that differences are due to k, and a hand-over of 100 steps; *column x F*: the column with F times stiffer contacts. Both are
coupled, then gravity grows to 1.2 times its value in 100 steps; both stages run to unbalanced ratios below 1e-5 on both sides.
Steps and messages (FORCE and VELOCITY) are those of these two stages. error: of the displacements of the rim's gridpoints; P/l:
of the forces of the discs there over the length of rim that belongs to a gridpoint; both as rms of the difference from k = 1 over
the rms at k = 1. gap: work of the rim on the grid's side minus that on the discs', over the larger of both; with an exchange in
every step it is round-off. Seconds are wall time of both stages, median of the repeats, each server in its own process and a line
between them (`scripts/relay.py`) with a delay of 0, 0.1 or 1 ms one way.
"""

import json
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from accuracy.common import alone
from colluvium import open_run
from colluvium.figures.style import styled
from coupler_protocol.files import checkpoint
from coupler_protocol.scene.reader import build_scene, read_scene
from coupler_protocol.wire.link_tcp import endpoint_from
from fdm_server.mesh.grid import build_grid
from fdm_server.mesh.window_zones import rim_of, window_zones

ROOT = Path(__file__).resolve().parents[2]
TITLE = "pauses between exchanges"
PICTURE = "accuracy_w4.png"
READ = """Fewer exchanges save time where messages are slow: at 1 ms one way, k = 20 takes a fifth of the time of k = 1, at an
error of some 1e-4. On one machine the gain ends at k of about 10, because the steps themselves remain. The larger k, the more
energy the held forces gain or lose (gap). Contacts stiffer than the zones beside them would make pauses unstable (shaded): there
the watch goes back to an exchange in every step, and nothing is saved."""
COLUMNS = {
    "case": "case",
    "every": "k",
    "latency": ("delay [ms]", lambda v: f"{v:g}"),
    "steps": "steps",
    "messages": "messages",
    "error": ("error", lambda v: "-" if v == 0.0 else f"{v:.1e}"),
    "traction_error": ("P/l", lambda v: "-" if v == 0.0 else f"{v:.1e}"),
    "gap": ("gap", lambda v: f"{v:.1e}"),
    "seconds": ("seconds", lambda v: f"{v:.2f}"),
    "spread": ("spread", lambda v: f"{v:.2f}"),
    "repeats": "repeats",
    "fell_back": ("back to 1", lambda v: v or "no"),
}
INTERVALS = {True: (1, 10), False: (1, 2, 5, 10, 20, 50)}  # by `fast`
LATENCIES = {True: (1.0,), False: (0.0, 0.1, 1.0)}  # [ms]
STIFFER = {True: (), False: (10, 100)}  # times the springs of the column
COUPLED = ("couple", "overload")
UNBROKEN = {"tension": 1e9, "shear": 1e9}  # [N]


def slope():
    """Tables of the slope."""
    return read_scene(ROOT / "configs" / "quick_slope.toml").model_dump(mode="json", exclude_none=True)


def column(stiffer=1):
    """Tables of the column: ground, discs and damping of the slope, springs `stiffer` times as stiff."""
    sides = [{"on": "left", "fix": "x"}, {"on": "right", "fix": "x"}, {"on": "bottom", "fix": "xy"}]
    tables = slope()
    spring = tables["discs"]["soil"]["spring"]
    tables["discs"]["soil"]["spring"] = {key: stiffer * value for key, value in spring.items()}
    return tables | {
        "grid": {"kind": "box", "length": 4.0, "height": 8.0, "zone_size": 0.5},
        "boundary": sides,
        "window": [{"name": "middle", "columns": [2, 5], "rows": [6, 11]}],
    }


def with_interval(tables, every):
    """The scene with pauses of up to `every` steps."""
    tables = json.loads(json.dumps(tables))
    tables["coupling"] = {"exchange_every": every}
    tables["discs"]["soil"]["bond"] = UNBROKEN
    tables["record"] = {"every": 100_000, "history": 10, "energy": True}
    equilibrium, fill, couple, overload = tables["stage"]
    overload["gravity_factor"] = {"to": 1.2, "over": 100}
    tables["stage"] = [equilibrium, fill, couple | {"handover": 100}, overload]
    return build_scene(tables)


def computed(scene, out, latency, origin=None):
    """Run both servers into folders of `out` with a line of this latency [ms] between them.

    origin: folder of an earlier run, to go on from its fill.
    """
    out.mkdir()
    path, grid = out / "scene.json", out / "grid"
    path.write_text(json.dumps(scene.resolved()), encoding="utf-8")
    more = [] if origin is None else [[f"--from={origin / side}@fill"] for side in ("grid", "discs")]
    first, second = more or ([], [])
    servers = [_start("fdm_server", path, "--bind", "tcp://127.0.0.1:0", "--out", grid, "--quiet", *first)]
    line = None
    try:
        endpoint = endpoint_from(str(grid / "endpoint"), 60.0)
        if latency:
            words = [sys.executable, ROOT / "scripts" / "relay.py", "--to", endpoint, "--latency", str(latency)]
            line = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
            endpoint = line.stdout.readline().strip()
        to = ("--connect", endpoint, "--rank", "1", "--out", out / "discs", "--quiet")
        servers.append(_start("dem_server", path, *to, *second))
        if any([server.wait() for server in servers]):
            raise RuntimeError(f"a server failed; see its messages above ({out.name})")
    finally:
        for process in (*servers, *([line] if line else [])):
            process.terminate()
            process.wait()


def _start(module, *words):
    return subprocess.Popen([sys.executable, "-P", "-m", module, *map(str, words)])


def outcome(scene, out):
    """What a run gave: steps, exchanges, why it fell back, seconds; moved (K,2) [m], traction (K,2) [Pa] of the rim."""
    info = json.loads((out / "grid" / "run.json").read_text(encoding="utf-8"))
    rows = [row for row in info["stages"] if row["name"] in COUPLED]
    found = {
        "steps": sum(row["steps"] for row in rows),
        "messages": 2 * sum(row.get("exchanges", row["steps"]) for row in rows),
        "fell_back": rows[-1].get("fell_back", ""),
        "broken": rows[-1]["bonds_broken"][0],
        "seconds": sum(row["seconds"][part] for row in rows for part in ("continuum", "waiting", "recording")),
    }
    grid = build_grid(scene)
    nodes = rim_of(grid, window_zones(grid, scene.window[0]))
    state = checkpoint.load(out / "grid" / "fdm.rank0.overload.h5")[0]["grid"]
    with open_run(out / "grid", out / "discs") as run:
        works = [np.abs(run.history("interface_work", rank)[1][-1]) for rank in (0, 1)]
    found["gap"] = float(abs(works[0] - works[1]) / max(works))
    length = np.linalg.norm(np.roll(grid.xy[nodes], -1, axis=0) - grid.xy[nodes], axis=1)
    share = 0.5 * (length + np.roll(length, 1))
    return found, np.asarray(state["displacement"])[nodes], np.asarray(state["applied"])[nodes] / share[:, None]


def difference(found, expected):
    """rms of the difference over the rms of `expected`."""
    return float(np.sqrt(np.mean((found - expected) ** 2) / np.mean(expected**2)))


def before(folder):
    """Displacements (N,2) [m] of all gridpoints before the discs took over."""
    return np.asarray(checkpoint.load(folder / "grid" / "fdm.rank0.fill.h5")[0]["grid"]["displacement"])


def case(name, tables, fast, folder):
    """Rows of a case, one for each k and delay; the fill of the first run is that of the others."""
    usual, repeats = None, 1 if fast else 3
    for every in INTERVALS[fast] if "x" not in name else (1, 10):
        scene, first = with_interval(tables, every), folder / f"{name} {every}"
        computed(scene, first, 0.0)
        for latency in LATENCIES[fast] if "x" not in name else (0.0,):
            seconds = []
            for repeat in range(repeats):
                out = folder / f"{name} {every} {latency:g} {repeat}"
                with alone():
                    computed(scene, out, latency, first)
                found, displacement, traction = outcome(scene, out)
                seconds.append(found["seconds"])
            grid = build_grid(scene)
            moved = displacement - before(first)[rim_of(grid, window_zones(grid, scene.window[0]))]
            usual = usual or (moved, traction)
            middle = statistics.median(seconds)
            row = {"case": name, "method": f"{latency:g} ms", "every": every, "latency": latency} | found
            row |= {"seconds": middle, "spread": (max(seconds) - min(seconds)) / middle, "repeats": repeats}
            row |= {"error": difference(moved, usual[0]), "traction_error": difference(traction, usual[1])}
            yield row | {"order": None, "reference": "k = 1"}


def run(fast):
    """Rows of all cases; fast: the column alone, k = 1 and 10, 1 ms, one repeat."""
    cases = {"column": column()} | ({} if fast else {"slope": slope()})
    cases |= {f"column x {factor}": column(factor) for factor in STIFFER[fast]}
    with tempfile.TemporaryDirectory() as folder:
        return [row for name, tables in cases.items() for row in case(name, tables, fast, Path(folder))]


@styled
def draw(rows, path):
    """Error against wall time, one curve a delay; energy gap against k; contacts over k, with what falls back shaded."""
    import matplotlib.pyplot as plt

    own = [name for name in dict.fromkeys(row["case"] for row in rows) if "x" not in name]
    figure, panels = plt.subplots(1, len(own) + 2, figsize=(9.6, 3.2), layout="constrained")
    for axes, name in zip(panels, own, strict=False):
        for method in dict.fromkeys(row["method"] for row in rows):
            points = [row for row in rows if (row["case"], row["method"]) == (name, method) and row["every"] > 1]
            axes.loglog([p["seconds"] for p in points], [p["error"] for p in points], "o-", markersize=3.5, label=method)
            for p in points:
                axes.annotate(f"{p['every']}", (p["seconds"], p["error"]), fontsize=6.0)
            exact = [row["seconds"] for row in rows if (row["case"], row["method"]) == (name, method) and row["every"] == 1]
            for seconds in exact:
                axes.axvline(seconds, color=axes.lines[-1].get_color(), linewidth=0.8, linestyle=":")
        axes.set(title=f"{name} (dotted: k = 1)", xlabel="wall time [s]", ylabel="error of displacements")
        axes.legend(fontsize=7.0)
    gap, region = panels[-2:]
    for name in own:
        points = {row["every"]: row["gap"] for row in rows if row["case"] == name}
        gap.loglog(list(points), [max(value, 1e-16) for value in points.values()], "o-", markersize=3.5, label=name)
    gap.set(title="energy of held forces", xlabel="k", ylabel="gap")
    gap.legend(fontsize=7.0)
    _draw_region(region, rows)
    figure.savefig(path)
    plt.close(figure)


def _draw_region(axes, rows):
    """Which settings kept their pauses, over the stiffness of contacts."""
    stiffness = {row["case"]: float(row["case"].partition(" x ")[2] or 1.0) for row in rows if row["case"].startswith("column")}
    points = [(stiffness[row["case"]], row["every"], bool(row["fell_back"])) for row in rows if row["case"] in stiffness]
    lost = [x for x, every, back in points if back and every > 1]
    for back, marker in ((False, "o"), (True, "x")):
        axes.loglog(*zip(*[(x, k) for x, k, b in points if b == back] or [(np.nan, np.nan)], strict=True), marker, markersize=4.0)
    if lost:
        kept = max((x for x, every, back in points if not back and every > 1), default=min(lost))
        axes.axvspan(np.sqrt(kept * min(lost)), 3.0 * max(lost), color="#c1502e", alpha=0.15)
    axes.set(title="x: back to 1", xlabel="springs over those of the column", ylabel="k")
