"""Which parameter of the discs moves which answer: one at a time around a calibrated set, tables and pictures.

    python scripts/studies/calibration_study.py SCENE ANSWER [--out DIR] [--only NAME ..] [--seeds N ..] [--set KEY=VALUE ..]
        [--at-once N] [--json FILE] [--pictures DIR]

SCENE is the scene of a calibration and ANSWER its answer.json. Tests are those of `colluvium calibrate`, at all stresses of
lab.confinement; each is computed once and kept in DIR, so that an interrupted study continues. `radius`, `porosity` and `content`
change the sample and keep the parameters; lab.bond_gap grows with the radius. Writes calibration_NAME.png for each NAME: E, nu, c
and phi over the parameter, with the standard deviation over the seeds.
"""

import argparse
import json
from pathlib import Path

import numpy as np

from colluvium.calibration.laboratory import SampleTests
from colluvium.calibration.parameters import SYMBOLS, UNITS
from colluvium.calibration.study import plan_of, with_table
from colluvium.calibration.targets import strength_name
from colluvium.figures.style import PAGE, styled
from colluvium.lab.strength import deviation, line_of
from coupler_protocol.scene.reader import read_scene

FACTORS = {"normal": (0.6, 1.6), "ratio": (0.5, 3.0), "friction": (0.5, 3.0), "bond": (0.5, 2.0)}
ROLLING = (0.05, 0.15)
SAMPLES = {
    "radius": ("discs.radius", (0.02, 0.05)),
    "porosity": ("discs.porosity", (0.13, 0.19)),
    "content": ("stones.content", (0.2, 0.6)),
}
NAMES = (*FACTORS, "rolling", *SAMPLES)
LABELS = {name: f"{SYMBOLS[name]}{f' [{UNITS[name]}]' if UNITS[name] else ''}" for name in UNITS}
LABELS |= {"radius": "radius [m]", "porosity": "porosity", "content": "content of stones"}
ANSWERS = {"E": ("E [MPa]", 1e-6), "nu": ("nu", 1.0), "c": ("c [kPa]", 1e-3), "phi": ("phi [deg]", 1.0)}


def places(name, values, scene):
    """Values of a parameter or a property of the sample in the study, that of the answer among them."""
    if name in SAMPLES:
        table, _, key = SAMPLES[name][0].partition(".")
        own = getattr(getattr(scene, table), key)
        return sorted({own, *SAMPLES[name][1]})
    if name == "rolling":
        return sorted({values.get("rolling", 0.0), *ROLLING})
    return sorted(float(f"{values[name] * factor:.3g}") for factor in (1.0, *FACTORS[name]))


def changes(name, value, scene):
    """Overrides that give the samples of a scene this value; the gap of bonds keeps its share of the radius."""
    own = [f"{SAMPLES[name][0]}={value}"]
    return [*own, f"lab.bond_gap={scene.lab.bond_gap * value / scene.discs.radius}"] if name == "radius" else own


def summary(found, pressures):
    """Means and standard deviations of E, nu, c, phi over seeds; found: answers of `SampleTests.measure`."""
    rows = []
    for one in found.values():
        side = np.array(pressures)
        line = line_of("biaxial", side, side + np.array([one.get(strength_name(p), np.nan) for p in pressures]))
        rows.append(
            {
                "E": one["young"],
                "nu": one["poisson"],
                "c": line.cohesion if line else np.nan,
                "phi": line.friction if line else np.nan,
            }
        )
    return {
        key: {"mean": float(np.mean([row[key] for row in rows])), "sd": deviation([row[key] for row in rows])} for key in ANSWERS
    }


def measure(options):
    """Rows: name, value, E, nu, c, phi of every set."""
    values = json.loads(options.answer.read_text(encoding="utf-8"))["parameters"]
    rows = []
    for name in options.only:
        base = with_table(read_scene(options.scene, options.set))
        for value in places(name, values, base):
            scene, changed = base, dict(values)
            if name in SAMPLES:
                scene = with_table(read_scene(options.scene, [*options.set, *changes(name, value, base)]))
            elif name != "rolling" or value > 0.0 or name in values:
                changed[name] = value
            plan, problems = plan_of(scene, options.scene.parent)
            assert not problems, problems
            tests = SampleTests(scene, plan.sample, plan.targets, options.out, options.at_once, print)
            pressures = [goal.pressure for goal in plan.targets.goals if goal.pressure]
            found = tests.measure(changed, options.seeds, False)
            if not found:
                continue
            row = {"name": name, "value": value, "answer": value == values.get(name), "seeds": len(found)} | summary(
                found, pressures
            )
            rows.append(row)
            print(line_of_row(row), flush=True)
    return rows


def line_of_row(row):
    """A row as a line of text."""
    parts = []
    for key, (label, scale) in ANSWERS.items():
        sd = row[key]["sd"]
        parts.append(f"{label} {scale * row[key]['mean']:.3g}" + (f" ± {scale * sd:.2g}" if sd is not None else ""))
    return f"{row['name']} {row['value']:.4g}: {', '.join(parts)} ({row['seeds']} seeds)"


@styled
def draw(rows, name, path):
    """E, nu, c and phi over a parameter."""
    import matplotlib.pyplot as plt

    own = [row for row in rows if row["name"] == name]
    figure, panels = plt.subplots(1, len(ANSWERS), figsize=(PAGE, 1.7), layout="constrained")
    for panel, (key, (label, scale)) in zip(panels, ANSWERS.items(), strict=True):
        x, y = [row["value"] for row in own], [scale * row[key]["mean"] for row in own]
        panel.errorbar(
            x,
            y,
            [scale * (row[key]["sd"] or 0.0) for row in own],
            fmt="o-",
            color="#1b6ca8",
            markersize=3.5,
            capsize=2.0,
            linewidth=1.0,
        )
        marked = [(row["value"], scale * row[key]["mean"]) for row in own if row["answer"]]
        if marked:
            panel.plot(*zip(*marked, strict=True), "o", color="#c1443c", markersize=5.0, zorder=3)
        panel.set(title=label, xlabel=LABELS[name])
        panel.set_ylim(0.0, 1.1 * max(scale * row[key]["mean"] for row in rows))  # of all pictures alike
        if name in FACTORS:
            panel.set_xscale("log")
            panel.set_xticks(x, [f"{value:.3g}" for value in x])
            panel.minorticks_off()
    figure.savefig(path)
    plt.close(figure)


def main(argv=None):
    """Measure, print, draw."""
    parser = argparse.ArgumentParser(description=__doc__.partition(":")[0])
    parser.add_argument("scene", type=Path)
    parser.add_argument("answer", type=Path)
    parser.add_argument("--out", type=Path, default=Path("runs/calibration_study"))
    parser.add_argument("--only", nargs="+", choices=NAMES, default=list(NAMES))
    parser.add_argument("--seeds", nargs="+", type=int, default=[1, 2])
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--at-once", type=int, default=2)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--pictures", type=Path)
    options = parser.parse_args(argv)
    options.out.mkdir(parents=True, exist_ok=True)
    rows = measure(options)
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    if options.pictures:
        options.pictures.mkdir(parents=True, exist_ok=True)
        for name in options.only:
            draw(rows, name, options.pictures / f"calibration_{name}.png")


if __name__ == "__main__":
    main()
