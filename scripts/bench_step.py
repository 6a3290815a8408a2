"""What a step of either code costs, beside reference loops in the same run.

    python scripts/bench_step.py --fdm | --dem | --fdm --dem [--fast] [--repeats R] [--json FILE]

Kernels are compiled and states brought up before anything is timed. Medians of wall time; compare them within one run, on a
machine that does nothing else.
"""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from bench import dem, fdm
from bench.timing_rows import show, write


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--fdm", action="store_true", help="the continuum")
    parser.add_argument("--dem", action="store_true", help="the discs")
    parser.add_argument("--fast", action="store_true", help="small sizes, few steps: to see that it runs")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--json", metavar="FILE")
    options = parser.parse_args()
    chosen = [code for code, wanted in ((fdm, options.fdm), (dem, options.dem)) if wanted]
    if not chosen:
        parser.error("say --fdm, --dem or both")
    rows = [row for code in chosen for row in code.run(options.fast, options.repeats)]
    show(rows)
    print(f"triad {rows[0]['companion']['triad_GB_per_s']:.1f} GB/s (one thread, same run)")
    if options.json:
        write(rows, options.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
