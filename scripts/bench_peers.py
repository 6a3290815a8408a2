"""The same boxes of discs in other engines: disc-steps a second on one core, with and without bonds, and ours over theirs.

    python scripts/bench_peers.py [--sizes 2500,10000,50000,200000] [--fast] [--repeats R] [--json FILE]

Engines that are installed run (docs/performance.md says how), of each other one there is a line. Every engine must show that it
does the same work. Exit code 0, also with no other engine at all; 4 if one is there but does not run, 6 if one computes
something else than ours.
"""

import argparse
import sys
from pathlib import Path
from statistics import median

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from bench.dem import SIZES
from bench.peers import ENGINES
from bench.peers.compare import box_rows
from bench.timing_rows import show, triad, write

from coupler_protocol.files.run_json import processor


def main():
    options = arguments()
    found = {engine: engine.version() for engine in ENGINES}
    for engine, version in found.items():
        print(f"{engine.NAME}: {version or 'not installed'}")
        for difference in engine.DIFFERENCES if version else ():
            print(f"    differs: {difference}")
    engines = [engine for engine, version in found.items() if version]
    work = 250_000 if options.fast else 8_000_000
    bandwidth = median(triad(options.repeats, 1_000_000 if options.fast else 8_000_000))
    companion = {"triad_GB_per_s": bandwidth, "cpu": processor()}
    rows, failed, differ = [], [], []
    for size in options.sizes:
        for bonded in (False, True):
            more = box_rows(size, bonded, engines, work, options.repeats, companion, not options.fast)
            show(more[0])
            for kept, new in zip((rows, failed, differ), more, strict=True):
                kept += new
    print(f"triad {bandwidth:.1f} GB/s (one thread, same run); {companion['cpu']}; one thread each, if not said otherwise")
    if options.json:
        write([in_full(row, found) for row in rows], options.json)
    for line in failed:
        print(f"did not run: {line}", file=sys.stderr)
    for line in differ:
        print(f"not the same work: {line}", file=sys.stderr)
    return 6 if differ else 4 if failed else 0


def arguments():
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", help=f"numbers of discs, of {', '.join(map(str, SIZES))}; default: all")
    parser.add_argument("--fast", action="store_true", help="smallest box, few steps, usual settings: to see that it runs")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--json", metavar="FILE")
    options = parser.parse_args()
    words = options.sizes.split(",") if options.sizes else [str(s) for s in SIZES][: 1 if options.fast else None]
    if unknown := [word for word in words if word not in map(str, SIZES)]:
        parser.error(f"no such box: {', '.join(unknown)}; there are {', '.join(map(str, SIZES))}")
    options.sizes = [int(word) for word in words]
    return options


def in_full(row, found):
    """The row with version and differences of its engine in its note; found: version of each engine."""
    for engine, version in found.items():
        if row["name"].startswith((f"{engine.NAME};", f"{engine.NAME},")):
            return row | {"note": f"{version}; {row['note']}; differences: {'; '.join(engine.DIFFERENCES)}"}
    return row


if __name__ == "__main__":
    sys.exit(main())
