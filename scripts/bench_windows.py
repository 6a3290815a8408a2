"""What a coupled step costs with N windows: the slowest of them rules while every process has a core.

    python scripts/bench_windows.py [--most N] [--steps N] [--repeats R] [--radius M] [--json FILE] [--page FILE]

Grounds with 1 .. N (default 4) windows of 3 x 3 m with equal discs, and one with N windows of which the last has discs of half
the radius, four times as many. Each is computed in a process for the grid and one for every window to the end of its couple
stage, and goes on for R pairs of stages of `--steps` and five times as many coupled steps at rest without frames: a coupled step
is the difference of a pair over that of their steps. Then the kernels of the grid and of every window run alone on those States.

    slowest    kernels of the slowest process in one step
    bound      the slowest process, or the work of all processes over the cores where these are fewer
    over       coupled step over bound

Medians; seconds of wall time.
"""

import argparse
import os
import sys
import tempfile
from pathlib import Path
from statistics import median

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from bench.coupled_step import coupled, kernels_of_discs, kernels_of_grid, with_measured_stages
from bench.timing_rows import row, triad, write
from pages import markdown, plain, write_section

from coupler_protocol.scene.reader import build_scene

SIDE, APART, ZONE = 3.0, 2.0, 0.5  # m: of a window, between windows and to the sides, of a zone
SMALLER = 0.5  # radius of the discs of the last window over that of the others, in the last ground
COLUMNS = {
    "name": "", "windows": "windows", "value": ("coupled step [us]", "{:,.0f}".format),
    "slowest": ("slowest [us]", "{:,.0f}".format), "by": "by", "bound": ("bound [us]", "{:,.0f}".format),
    "over": ("step over bound", "{:.2f}".format),
}  # fmt: skip


def ground(windows, radius, smaller=False):
    """The scene of a ground under uniform stress with equal windows side by side; smaller: finer discs in the last one."""
    spring, rest = {"normal": 5e7, "shear": 2e7}, {"ratio": 1e-4, "steps": 3000}
    stress = {"xx": -120e3, "yy": -200e3, "zz": -130e3}
    tables = []
    for i in range(windows):
        x = APART + i * (SIDE + APART)
        tables.append(
            {"name": f"w{i + 1}", "polygon": [[x, APART], [x + SIDE, APART], [x + SIDE, APART + SIDE], [x, APART + SIDE]]}
        )
    if smaller:
        tables[-1]["discs"] = {"radius": SMALLER * radius}
    length, height = APART + windows * (SIDE + APART), 2.0 * APART + SIDE
    return build_scene(
        {
            "format": 1,
            "seed": 1,
            "grid": {"kind": "box", "length": length, "height": height, "zone_size": ZONE},
            "material": [{"name": "ground", "density": 2700.0, "elastic": {"bulk": 0.5e9, "shear": 0.15e9}}],
            "initial_stress": stress,
            "boundary": [{"on": side, "fix": "xy"} for side in ("left", "right", "bottom", "top")],
            "damping": {"local": 0.8},
            "window": tables,
            "discs": {
                "radius": radius,
                "damping": {"local": 0.7},
                "soil": {"density": 2000.0, "spring": spring, "friction": {"coefficient": 0.55}},
            },
            "stage": [
                {"name": "equilibrium", "kind": "equilibrium", "gravity": 0.0, "until": {"steps": 10}},
                {"name": "fill"},
                {"name": "couple", "handover": 100, "until": rest},
            ],
        }
    )


def measured(name, scene, steps, repeats, out):
    """The row of a ground: its coupled step, and the kernels of its processes alone."""
    found = coupled(with_measured_stages(scene, steps, repeats), out)
    alone = {"grid": median(kernels_of_grid(scene, out, steps, repeats))}
    for rank, window in enumerate(scene.window, start=1):
        alone[window.name] = median(kernels_of_discs(scene, out, steps, repeats, rank))
    return compared(name, [1e6 * seconds for seconds in found], {key: 1e6 * seconds for key, seconds in alone.items()}, cores())


def compared(name, steps, alone, cores):
    """Row of coupled `steps` [us] of a ground beside the kernels `alone` [us] of its processes on so many cores."""
    by = max(alone, key=alone.get)
    bound = max(alone[by], sum(alone.values()) / cores)
    found = row(name, len(alone) - 1, steps, "us", [], f"{cores} cores")
    return found | {
        "windows": len(alone) - 1,
        "alone": alone,
        "slowest": alone[by],
        "by": by,
        "bound": bound,
        "over": found["value"] / bound,
    }


def cores():
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0))


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--most", type=int, default=4, metavar="N")
    parser.add_argument("--steps", type=int, default=1000, metavar="N")
    parser.add_argument("--repeats", type=int, default=5, metavar="R")
    parser.add_argument("--radius", type=float, default=0.05, metavar="M")
    parser.add_argument("--json", metavar="FILE")
    parser.add_argument("--page", metavar="FILE")
    options = parser.parse_args(argv)
    grounds = [("equal windows", ground(n, options.radius)) for n in range(1, options.most + 1)]
    grounds.append(("the last one finer", ground(options.most, options.radius, smaller=True)))
    with tempfile.TemporaryDirectory() as folder:
        rows = [
            measured(name, scene, options.steps, options.repeats, Path(folder) / f"{i}")
            for i, (name, scene) in enumerate(grounds)
        ]
    companion = {"triad_GB_per_s": median(triad(options.repeats))}
    rows = [one | {"companion": companion} for one in rows]
    print(plain(rows, COLUMNS))
    if options.page:
        write_section(options.page, "windows", markdown(rows, COLUMNS))
    if options.json:
        write(rows, options.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
