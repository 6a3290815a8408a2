"""The tests of a calibrated set at the rate of `colluvium calibrate` and at half of it: does the rate change an answer?

    python scripts/studies/calibration_rate.py SCENE ANSWER [--out DIR] [--seeds N ..] [--set KEY=VALUE ..] [--at-once N]
        [--json FILE]

SCENE is the scene of a calibration and ANSWER its answer.json. With the folder of the calibration as DIR, its own tests are
used. Prints, for the full tests at all stresses and for the short ones, the means at both rates, the mean change of the same
samples, and the standard deviation over the seeds, which is pooled over the stresses (colluvium/lab/summary.py).
"""

import argparse
import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # what the scripts share

from pages import markdown

from colluvium.calibration.laboratory import SampleTests
from colluvium.calibration.study import plan_of, with_table
from colluvium.lab.summary import UNITS, rates, rates_in_words
from coupler_protocol.scene.reader import read_scene

KINDS = {"full": False, "short": True}
SHOWN = {"full": ("E", "nu", "peak_axial", "dilation"), "short": ("E", "nu")}  # answers that a calibration uses
COLUMNS = {
    "kind": "tests", "answer": "answer", "full": "rate", "slower": "half the rate", "change": "change", "scatter": "± seeds",
}  # fmt: skip


class Slower(SampleTests):
    """Tests at half the rate."""

    factor = 0.5


def rows_of(laboratory, values, seeds, short):
    """Rows of the tests, as those of `colluvium lab`."""
    laboratory.measure(values, seeds, short)
    return [
        {"name": row["folder"], "sample": row["sample"], "pressure": row["pressure"], "seed": row["seed"]}
        | {"factor": laboratory.factor}
        | row["answers"]
        for row in laboratory.used.values()
        if row["short"] == short and row["seed"] in seeds
    ]


def measure(options):
    """Rows of `rates` for the full and for the short tests, and what they say in words."""
    values = json.loads(options.answer.read_text(encoding="utf-8"))["parameters"]
    scene = with_table(read_scene(options.scene, options.set))
    plan, problems = plan_of(scene, options.scene.parent)
    assert not problems, problems
    found = {}
    for kind, short in KINDS.items():
        both = []
        for laboratory in (SampleTests, Slower):
            tests = laboratory(scene, plan.sample, plan.targets, options.out, options.at_once, print)
            both.append(rows_of(tests, values, options.seeds, short))
        rows = [row for row in rates(*both) if row["answer"] in SHOWN[kind]]
        found[kind] = {"rates": rows, "words": "; ".join(rates_in_words(rows))}
    return found


def table(found):
    """Markdown: kind of test, answer, at the rate, at half of it, change, scatter."""
    rows = []
    for kind, own in found.items():
        for row in own["rates"]:
            if row["answer"] in SHOWN[kind]:
                unit, size, digits = UNITS[row["answer"]]
                cells = {key: f"{row[key] / size:.{digits}f}" for key in ("full", "slower", "scatter") if row[key] is not None}
                name = f"{row['answer']} [{unit}]" if unit else row["answer"]
                rows.append(
                    {"kind": kind, "answer": name, "change": f"{row['change'] / size:+.{digits}f}", "scatter": "-"} | cells
                )
    return markdown(rows, COLUMNS)


def main(argv=None):
    """Measure, print."""
    parser = argparse.ArgumentParser(description=__doc__.partition(":")[0])
    parser.add_argument("scene", type=Path)
    parser.add_argument("answer", type=Path)
    parser.add_argument("--out", type=Path, default=Path("runs/calibration_rate"))
    parser.add_argument("--seeds", nargs="+", type=int, default=[1, 2, 11, 12, 13])
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--at-once", type=int, default=2)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args(argv)
    options.out.mkdir(parents=True, exist_ok=True)
    found = measure(options)
    print(table(found))
    for kind, own in found.items():
        print(f"{kind} tests: {own['words']}")
    if options.json:
        options.json.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
