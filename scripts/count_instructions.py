"""Instructions that both processes of a run retire in a coupled step, counted by callgrind.

    python scripts/count_instructions.py [SCENE] [--set KEY=VALUE] [--after N] [--steps N] [--tree NAME=DIR ..] [--json FILE]
                                         [--page FILE]

Runs SCENE (default configs/paper_slope.toml) through the first --after steps of its last stage, in two processes as they are,
which also compiles their kernels. Then both continue from there under callgrind: after a short stage in which they load them,
through two stages of --steps and 5 times as many coupled steps, with histories and without frames, with gravity as in the last
stage. The count of a step is the difference of both stages over the difference of their steps: what a stage costs once is not in
it. It does not depend on the load of the machine while a step under callgrind takes less than 0.2 s, after which a side
looks at its clocks.

Instructions are those of all threads, without those of the system. Kernels are compiled for `nehalem` (SSE4.2), because valgrind
does not know all instructions of wider vectors. A side that waits sleeps at once: how often it looks would depend on its speed.

--tree NAME=DIR: checkouts with an installation in DIR/.venv, counted one after the other with the same scene (default: this one).
Three minutes a tree, and as long again with an empty cache of kernels. Needs valgrind and an x86-64 processor.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from bench.timing_rows import write
from pages import markdown, plain, write_section

from colluvium.running.processes import as_toml
from coupler_protocol.exits import EnvironmentFailed

ROOT = Path(__file__).resolve().parent.parent
LONGER = 5  # the second counted stage over the first
SETTLED = 200  # steps of a stage before the counted ones: some lists of pairs are built in it
SIDES = {"grid": "fdm_server", "discs": "dem_server"}
PROCESSOR = {"NUMBA_CPU_NAME": "nehalem", "NUMBA_CPU_FEATURES": ""}
PATIENT = {"timeout": 60.0, "give_up": 3600.0}  # [s] of [link]: a step takes a hundred times longer
VALGRIND = ["valgrind", "--tool=callgrind", "--instr-atstart=no", "--fair-sched=try", "--quiet"]
LONGEST = 3600  # [s] of a run
COLUMNS = {
    "tree": "tree", "grid": ("grid [million]", "{:.3f}".format), "discs": ("discs [million]", "{:.3f}".format),
    "both": ("both [million]", "{:.3f}".format),
}  # fmt: skip


def counted_scene(data, after, steps):
    """The scene `data` with its last stage in parts: `after` steps, some to load kernels, two counted ones, and the end.

    Gravity may change linearly in the last stage, from 1 g; the parts are steps of the same change.
    """
    *stages, last = data["stage"]
    target = last.get("gravity_factor", 1.0)
    to, over = (target["to"], target["over"]) if isinstance(target, dict) else (target, 1)
    parts, done = [], 0
    counts = {"begun": after, "settled": SETTLED, "counted short": steps, "counted long": LONGER * steps, "end": 1}
    for name, count in counts.items():
        done += count
        part = {**last, "name": name, "kind": "overload", "until": {"steps": count}}
        if isinstance(target, dict):
            part["gravity_factor"] = {"to": 1.0 + (to - 1.0) * min(done / over, 1.0), "over": count}
        parts.append(part)
    record = {"every": 10**9, **{key: value for key, value in data.get("record", {}).items() if key == "history"}}
    patient = {**data.get("link", {}), **PATIENT}
    return {**data, "stage": [*stages, *parts], "record": record, "link": patient}


def run(tree, scene, out, settings, words=(), counted=None):
    """Both servers of a tree through the scene; counted: folder for the counts of callgrind, None for a run as it is."""
    python, environment = tree / ".venv" / "bin" / "python", {**os.environ, **PROCESSOR}
    address = "local" if (tree / "coupler_protocol" / "wire" / "gate.py").exists() else "tcp://127.0.0.1:0"
    ends = {"grid": ["--bind", address], "discs": ["--connect", out / "endpoint", "--rank", 1]}
    processes = []
    try:
        if counted is not None:
            environment["COLLUVIUM_NO_HEARTBEAT"] = "1"  # a slow side has not gone
        for side, server in SIDES.items():
            program = [python, "-P", "-m", server]
            if counted is not None:
                counts = f"--callgrind-out-file={counted / side}"
                program = [*VALGRIND, counts, python, Path(__file__).parent / "bench" / "counted_server.py", server]
            options = [word for text in settings for word in ("--set", text)]
            line = [*program, scene, "--out", out, "--quiet", *options, *words, *ends[side]]
            processes.append(subprocess.Popen([*map(str, line)], cwd=tree, env=environment))
        until = time.monotonic() + LONGEST
        while None in (codes := [process.poll() for process in processes]) and not any(codes) and time.monotonic() < until:
            time.sleep(0.2)
    finally:
        for process in processes:
            process.kill()
            process.wait()
    if any(code != 0 for code in codes):
        raise EnvironmentFailed(f"the servers of {tree} ended with {codes}")


def counts_in(folder, side):
    """{stage: instructions} in the files that callgrind wrote for a side."""
    found = {}
    for path in sorted(folder.glob(f"{side}*")):
        text = path.read_text(encoding="utf-8", errors="replace")
        stage, total = re.search(r"^desc: Trigger: .*?(counted \w+)$", text, re.M), re.search(r"^totals: (\d+)", text, re.M)
        if stage and total:
            found[stage[1]] = int(total[1])
    return found


def instructions_of_step(tree, scene, settings, folder, steps):
    """{side: instructions a coupled step} of a tree; scene: file of a `counted_scene`."""
    run(tree, scene, folder / "plain", settings)
    (folder / "counts").mkdir()
    run(tree, scene, folder / "counted", settings, ["--from", f"{folder / 'plain'}@begun"], folder / "counts")
    found = {}
    for side in SIDES:
        counts = counts_in(folder / "counts", side)
        if counts.keys() != {"counted short", "counted long"}:
            raise EnvironmentFailed(f"callgrind counted {sorted(counts)} of the {side} of {tree}")
        found[side] = (counts["counted long"] - counts["counted short"]) / ((LONGER - 1) * steps)
    return found


def named_tree(text):
    """(name, folder) of NAME=DIR."""
    name, _, folder = text.partition("=")
    path = Path(folder).resolve()
    if not folder or not (path / ".venv" / "bin" / "python").exists():
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=DIR with a checkout that has an installation in DIR/.venv")
    return name, path


def main():
    """Entry point; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", nargs="?", type=Path, default=ROOT / "configs" / "paper_slope.toml", metavar="SCENE")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="overrides a key of the scene")
    parser.add_argument("--after", type=int, default=20_000, metavar="N", help="steps of the last stage before (default 20000)")
    parser.add_argument("--steps", type=int, default=100, metavar="N", help="of the first counted stage (default 100)")
    parser.add_argument("--tree", action="append", type=named_tree, metavar="NAME=DIR", help="default: this checkout")
    parser.add_argument("--json", metavar="FILE")
    parser.add_argument("--page", metavar="FILE", help="page whose section `instructions` gets the table")
    options = parser.parse_args()
    if shutil.which("valgrind") is None:
        raise SystemExit("valgrind is not installed (Debian: apt-get install valgrind)")
    rows = []
    with tempfile.TemporaryDirectory() as name:
        scene = Path(name) / "scene.toml"
        data = counted_scene(tomllib.loads(options.scene.read_text(encoding="utf-8")), options.after, options.steps)
        scene.write_text(as_toml(data), encoding="utf-8")
        for tree, path in options.tree or [("this", ROOT)]:
            folder = Path(name) / f"tree {len(rows)}"
            folder.mkdir()
            found = instructions_of_step(path, scene, options.set, folder, options.steps)
            rows.append(
                {"tree": tree, **{side: 1e-6 * count for side, count in found.items()}, "both": 1e-6 * sum(found.values())}
            )
            print(f"{tree}: {rows[-1]['both']:.3f} million instructions a coupled step", flush=True)
    print(plain(rows, COLUMNS))
    if options.json:
        write(rows, options.json)
    if options.page:
        write_section(options.page, "instructions", markdown(rows, COLUMNS))
    return 0


if __name__ == "__main__":
    sys.exit(main())
