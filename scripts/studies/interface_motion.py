"""How well grid and discs keep together along the rims of a run: slip and opening of the ring, P/l against the zones' stress.

    python scripts/studies/interface_motion.py RUN_DIR [--gravity G [G ...]] [--json FILE]

A row for the end of every stage with discs, and for the first frames with given gravity factors: root mean square and largest
of the changes of gaps (opening) and of the ways along the rim (slip) between control discs and the first free discs that
touched them when the window took over, in smallest radii of free discs (colluvium/results/ring_motion.py); how many of these
pairs have no contact any more; the rms difference between P/l and the stress of the adjoining zones over the rms of that
(run.json, traction_difference; ends of stages only)."""

import argparse
import json
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # what the scripts share

import pages

from colluvium import open_run

COLUMNS = {
    "window": "window",
    "stage": "stage",
    "gravity": ("gravity [g]", lambda v: f"{v:.2f}"),
    "pairs": "pairs",
    "parted": ("no contact [%]", lambda v: f"{100 * v:.1f}"),
    "opening_rms": ("opening, rms [r]", lambda v: f"{v:.2g}"),
    "opening_max": ("largest", lambda v: f"{v:.2g}"),
    "slip_rms": ("slip, rms [r]", lambda v: f"{v:.2g}"),
    "slip_max": ("largest ", lambda v: f"{v:.2g}"),
    "traction": ("P/l [%]", lambda v: "-" if v is None else f"{100 * v:.1f}"),
}


def rows(run, factors=()):
    """One row a window and moment at which its discs were recorded, in their order."""
    found = []
    for number, rank in enumerate(run.windows):
        ends = {run.last_frame(stage["name"]): stage for stage in run.info["stages"] if stage["name"] in run.stages}
        own = [frame for frame in range(len(run.frames)) if run.has(frame, rank)]
        reached = [[frame for frame in own if run.frames[frame].gravity_factor >= factor] for factor in factors]
        for frame in sorted({*ends} & {*own} | {frames[0] for frames in reached if frames}):
            traction = ends.get(frame, {}).get("traction_difference")
            found.append(_row(run, frame, rank) | {"traction": traction and traction[number]})
    return found


def _row(run, frame, rank):
    discs, motion, moment = run.discs(frame, rank), run.ring_motion(frame, rank), run.frames[frame]
    smallest = discs.radius[discs.control == 0].min()
    values = {"window": run.scene["window"][rank - 1]["name"], "stage": moment.stage, "gravity": moment.gravity_factor}
    values |= {"pairs": len(motion.free), "parted": float(motion.parted.mean())}
    for name, lengths in (("opening", motion.opening), ("slip", motion.slip)):
        values[f"{name}_rms"] = float(np.sqrt(np.mean(lengths**2)) / smallest)
        values[f"{name}_max"] = float(np.abs(lengths).max() / smallest)
    return values


def main(argv=None):
    """Print the table in Markdown."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("run", metavar="RUN_DIR", type=Path)
    parser.add_argument("--gravity", metavar="G", type=float, nargs="+", default=(), help="gravity factors")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the rows to FILE")
    options = parser.parse_args(argv)
    with open_run(options.run) as run:
        found = rows(run, options.gravity)
    print(pages.markdown(found, COLUMNS))
    if options.json:
        options.json.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
