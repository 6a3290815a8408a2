"""What the first run of a scene compiles, and what that costs.

    python scripts/compile_times.py [SCENE] [--set KEY=VALUE ..] [--json FILE]

Runs SCENE (default configs/paper_slope.toml) twice in processes of its own, first with an empty cache of kernels, then with what
the first run has left there. Prints the seconds of both runs, what each process compiled, and the ten most expensive functions
with their shares of all compilation and the number of their specialisations. Shares do not depend on the load of the machine.
"""

import argparse
import json
import os
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from colluvium.running import processes
from coupler_protocol.scene.reader import read_scene

SHOWN = 10  # functions


def parts(info):
    """{process: row `compiled` of run.json} of all processes that compiled something."""
    found = {"grid" if info.get("zones") else "discs": info.get("compiled")}
    found |= {f"discs {window['name']}": window.get("compiled") for window in info["windows"] if "name" in window}
    return {name: compiled for name, compiled in found.items() if compiled}


def dearest(info):
    """Rows of the functions that took most seconds: process, function, seconds, specialisations, share of all compilation."""
    of_all = sum(compiled["seconds"] for compiled in parts(info).values())
    rows = [
        {"process": name, **row, "share": row["seconds"] / of_all}
        for name, compiled in parts(info).items()
        for row in compiled["most_expensive"]
    ]
    return sorted(rows, key=lambda row: -row["seconds"])[:SHOWN]


def as_text(cold, warm):
    """Lines of the report. cold, warm: run.json of both runs."""
    more = cold["seconds"] - warm["seconds"]
    yield f"empty cache {cold['seconds']:.1f} s, full cache {warm['seconds']:.1f} s: {more:.1f} s more"
    for name, compiled in parts(cold).items():
        yield f"{name}: {compiled['functions']} functions compiled, {compiled['seconds']:.1f} s"
    yield f"{'process':<12} {'function':<58} {'share':>6} {'times':>6}"
    for row in dearest(cold):
        yield f"{row['process']:<12} {row['function']:<58} {100 * row['share']:4.1f} % {row['specialisations']:>6}"


def runs(path, settings, folder):
    """run.json of a run with an empty cache of kernels and of one with a full cache; settings: texts KEY=VALUE."""
    os.environ["NUMBA_CACHE_DIR"] = str(folder / "cache")
    windows = processes.windows_of(read_scene(path, settings))
    found = []
    for name in ("cold", "warm"):
        (folder / name).mkdir()
        options = [word for text in settings for word in ("--set", text)]
        processes.checked(processes.run_files(path, folder / name, windows, ["--quiet", *options]))
        found.append(json.loads((folder / name / "run.json").read_text(encoding="utf-8")))
    return found


def main():
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", nargs="?", default="configs/paper_slope.toml", metavar="SCENE")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="as for `colluvium run`")
    parser.add_argument("--json", metavar="FILE", help="writes both run.json and the rows as one file")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        cold, warm = runs(options.scene, options.set, Path(folder))
    print(*as_text(cold, warm), sep="\n")
    if options.json:
        found = {"cold": cold, "warm": warm, "dearest": dearest(cold)}
        Path(options.json).write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
