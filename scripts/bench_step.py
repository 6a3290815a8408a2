"""What a step of either code costs, beside reference loops in the same run.

    python scripts/bench_step.py [--fdm] [--dem] [--quick | --fast] [--repeats R] [--json FILE]

Without --fdm and --dem, both codes. `--quick` takes two minutes on two cores: ratios of cases in turns, and it says what it
leaves out. Kernels are compiled and states brought up before anything is timed. A row is printed as soon as it is known (standard
output), and what is prepared, compiled or measured meanwhile (standard error). Medians of wall time; compare them within one run,
on a machine that does nothing else.
"""

import argparse
import sys
from functools import partial
from pathlib import Path
from statistics import median

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from bench import dem, fdm, quick
from bench.announcements import announcements
from bench.timing_rows import show, triad, write


def main(words=None):
    options = arguments(words)
    kinds = {
        "fdm": quick.fdm_rows if options.quick else partial(fdm.rows, options.fast, options.repeats),
        "dem": quick.dem_rows if options.quick else partial(dem.rows, options.fast, options.repeats),
    }
    chosen = [name for name in kinds if getattr(options, name)] or list(kinds)
    if options.quick:
        print(quick.LEFT_OUT, flush=True)
    with announcements() as say:
        bandwidth = median(triad(options.repeats, 1_000_000 if options.fast else 8_000_000))
        print(f"triad {bandwidth:.1f} GB/s (one thread, same run)", flush=True)
        companion, rows = {"triad_GB_per_s": bandwidth}, []
        for name in chosen:
            for row in kinds[name](companion=companion, say=say):
                show([row])
                rows.append(row)
    if options.json:
        write(rows, options.json)
    return 0


def arguments(words):
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--fdm", action="store_true", help="the continuum")
    parser.add_argument("--dem", action="store_true", help="the discs")
    extent = parser.add_mutually_exclusive_group()
    extent.add_argument("--quick", action="store_true", help="the most important ratios, in two minutes on two cores")
    extent.add_argument("--fast", action="store_true", help="small sizes, few steps: to see that it runs")
    parser.add_argument("--repeats", type=int, default=5, help="of the whole measurement (default 5); --quick takes more turns")
    parser.add_argument("--json", metavar="FILE")
    return parser.parse_args(words)


if __name__ == "__main__":
    sys.exit(main())
