"""How well the standard errors of regions ([[measure]]) tell how much packings of one kind differ: many packings, as a table.

    python scripts/studies/measuring_study.py [--seeds N] [--cases NAME ..] [--fast] [--json FILE]

Packings are those of scripts/studies/fabric_study.py, at 100 kPa in a ring. In each of them the ring is then shortened once more,
by 1e-4 along y, and the displacements are taken as velocities. Circles of three radii in the middle, and a turned square, are
measured as in a run.

scatter: standard deviation over the packings, in percent of the mean, of porosity in 0.001, of strain rates in percent of the
applied 1e-4. error / scatter: root mean square of the standard errors over the scatter. within: share of the packings of which
the mean over all packings is within two standard errors. --fast: 6 packings of 0.7 m."""

import argparse
import json
from pathlib import Path

import numpy as np
from fabric_study import CASES, FAST, packed, shorten

from coupler_protocol.measures.regions import Region
from dem_server.observe.measuring import measured

SEEDS, STRAIN = 20, 1e-4
KINDS = ("graded, 1 m", "inward, 1.4 m", "stones, 2 m", "loaded, 1.4 m")
SHARES = (0.18, 0.28, 0.4)  # radii of circles, and half the side of the square, over the side of the packing
NAMES = ("stress_yy", "stress_xy", "porosity", "coordination", "sliding", "strain_rate_yy")
HEAD = ("packings", "region", "bodies", "quantity", "mean", "scatter", "error / scatter", "within")


def regions(case):
    """Regions of a packing by name."""
    middle = 0.5 * case.side
    found = {f"circle, {share * case.side:.2g} m": Region((middle, middle, share * case.side)) for share in SHARES}
    turned = 0.4 * case.side * np.array([[np.cos(a), np.sin(a)] for a in np.radians([20.0, 110.0, 200.0, 290.0])])
    return found | {f"square, {0.4 * 2**0.5 * case.side:.2g} m": Region(middle + turned)}


def values(case, seeds):
    """{region: {name: values (seeds,)}} of the packings of a case."""
    found = {}
    for seed in seeds:
        model, state = packed(case, seed)
        before = state.x.copy()
        shorten(model, state, STRAIN)
        state.v[:] = state.x - before
        for name, region in regions(case).items():
            found.setdefault(name, []).append(measured(model, state, region))
    return {name: {key: np.array([row[key] for row in rows]) for key in rows[0]} for name, rows in found.items()}


def rows(case, seeds):
    """Rows of the table, as dictionaries."""
    for region, columns in values(case, seeds).items():
        for name in NAMES:
            value, error = columns[name], columns[f"{name}_error"]
            mean, scatter = float(value.mean()), float(value.std(ddof=1))
            if scatter == 0.0:  # no contact slides
                continue
            yield {
                "case": case.name,
                "region": region,
                "bodies": float(columns["bodies"].mean()),
                "quantity": name,
                "mean": mean,
                "scatter": scatter,
                "ratio": float(np.sqrt(np.nanmean(error**2)) / scatter),
                "within": float((np.abs(value - mean) <= 2.0 * error).mean()),
            }


def line_of(row):
    """A row of the table as texts."""
    size = {"porosity": 1e-3, "strain_rate_yy": 1e-2 * STRAIN, "stress_xy": 1e3}.get(row["quantity"], 1e-2 * abs(row["mean"]))
    unit = {"porosity": "e-3", "stress_xy": " kPa"}.get(row["quantity"], " %")
    texts = [row["case"], row["region"], f"{row['bodies']:.0f}", row["quantity"], f"{row['mean']:.3g}"]
    return [*texts, f"{row['scatter'] / size:.2g}{unit}", f"{row['ratio']:.2f}", f"{row['within']:.2f}"]


def main(arguments=None):
    """Run the study; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=SEEDS, metavar="N", help=f"packings of each kind (default {SEEDS})")
    parser.add_argument("--cases", nargs="+", choices=KINDS, default=KINDS, metavar="NAME", help="default: all")
    parser.add_argument("--fast", action="store_true", help="6 packings of 0.7 m")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the numbers there, too")
    options = parser.parse_args(arguments)
    cases = [FAST[0]] if options.fast else [case for case in CASES if case.name in options.cases]
    kept = []
    print("| " + " | ".join(HEAD) + " |\n" + "| --- " * len(HEAD) + "|")
    for case in cases:
        for row in rows(case, range(1, 1 + (6 if options.fast else options.seeds))):
            kept.append(row)
            print("| " + " | ".join(line_of(row)) + " |", flush=True)
    if options.json:
        options.json.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
