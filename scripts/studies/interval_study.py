"""Cost and benefit of pauses between exchanges: steps, messages, error and seconds for k = coupling.exchange_every = 1 to 50.

    python scripts/studies/interval_study.py [--fast] [--json FILE] [--page FILE]

*column*: 4 x 8 m of ground under its weight with a window of 2 x 3 m; *slope*: `configs/quick_slope.toml` with unbreakable
bonds, so that differences are due to k, and a hand-over of 100 steps. Both are coupled, then gravity grows to 1.2 times its
value in 100 steps; both stages run to unbalanced ratios below 1e-5 on both sides. Steps and messages (FORCE and VELOCITY) are
those of these two stages, and so are displacements of the rim's gridpoints; P/l is the force of the discs there over the length
of rim that belongs to a gridpoint. Both columns are errors: rms of the difference from k = 1 over the rms at k = 1. Seconds are
wall time of both stages, with each server in its own process and a line between them (`scripts/relay.py`) with a delay of 0, 0.1
or 1 ms one way.

Rewrites its section of docs/accuracy.md; with --fast it does not: the column alone, k = 1 and 10, 1 ms.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # what the scripts share

import pages

from coupler_protocol.files import checkpoint
from coupler_protocol.scene.reader import build_scene, read_scene
from coupler_protocol.wire.link_tcp import endpoint_from
from fdm_server.mesh.grid import build_grid
from fdm_server.mesh.window_zones import rim_of, window_zones

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "accuracy.md"
INTERVALS = {True: (1, 10), False: (1, 2, 5, 10, 20, 50)}  # by `fast`
LATENCIES = {True: (1.0,), False: (0.0, 0.1, 1.0)}  # [ms]
COUPLED = ("couple", "overload")
UNBROKEN = {"tension": 1e9, "shear": 1e9}  # [N]
TITLE = "## Pauses between exchanges"


def slope():
    """Tables of the slope."""
    return read_scene(ROOT / "configs" / "quick_slope.toml").model_dump(mode="json", exclude_none=True)


def column():
    """Tables of the column: ground, discs and damping of the slope."""
    sides = [{"on": "left", "fix": "x"}, {"on": "right", "fix": "x"}, {"on": "bottom", "fix": "xy"}]
    return slope() | {
        "grid": {"kind": "box", "length": 4.0, "height": 8.0, "zone_size": 0.5},
        "boundary": sides,
        "window": [{"name": "middle", "columns": [2, 5], "rows": [6, 11]}],
    }


def with_interval(tables, every):
    """The scene with pauses of up to `every` steps."""
    tables = json.loads(json.dumps(tables))
    tables["coupling"] = {"exchange_every": every}
    tables["discs"]["soil"]["bond"] = UNBROKEN
    tables["record"] = {"every": 100_000, "history": 10}
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
    """Rows of a case, one for each k."""
    usual = None
    for every in INTERVALS[fast]:
        scene, first = with_interval(tables, every), folder / f"{name} {every}"
        row = {"case": name, "every": every}
        for latency in LATENCIES[fast]:
            begin = latency == LATENCIES[fast][0]
            out = first if begin else folder / f"{name} {every} {latency:g}"
            computed(scene, out, latency, None if begin else first)
            found, displacement, traction = outcome(scene, out)
            grid = build_grid(scene)
            moved = displacement - before(first)[rim_of(grid, window_zones(grid, scene.window[0]))]
            usual = usual or (moved, traction)
            row |= found | {f"seconds_{latency:g}": found["seconds"]}
        del row["seconds"]
        yield row | {"displacement_error": difference(moved, usual[0]), "traction_error": difference(traction, usual[1])}


def columns(rows):
    """Headings of the table, with the latencies that there are."""
    latencies = [key for key in rows[0] if key.startswith("seconds_")]
    return (
        {"case": "case", "every": "k", "steps": "steps", "messages": "messages"}
        | {"displacement_error": ("rim displacement", _error), "traction_error": ("P/l", _error)}
        | {key: (f"s at {key.partition('_')[2]} ms", lambda value: f"{value:.2f}") for key in latencies}
        | {"fell_back": ("back to 1", lambda value: value or "no")}
    )


def _error(value):
    return "-" if value == 0.0 else f"{value:.1e}"


def main(argv=None):
    """Run the study; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--fast", action="store_true", help="the column alone, k = 1 and 10, 1 ms")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the rows to FILE")
    parser.add_argument("--page", metavar="FILE", type=Path, default=PAGE, help="page whose section is rewritten, without --fast")
    options = parser.parse_args(argv)
    cases = {"column": column()} if options.fast else {"column": column(), "slope": slope()}
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name, tables in cases.items():
            for row in case(name, tables, options.fast, Path(folder)):
                print(pages.plain([row], columns([row])).splitlines()[-1], file=sys.stderr, flush=True)
                rows.append(row)
    print(pages.plain(rows, columns(rows)))
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    if not options.fast:
        text = "\n\n".join([TITLE, "`python scripts/studies/interval_study.py`", TEXT, pages.folded(rows, columns(rows))])
        pages.write_section(options.page, "interval", text)
    return 0


TEXT = __doc__.split("\n\n")[2]

if __name__ == "__main__":
    sys.exit(main())
