"""What comes back from the interface, measured and predicted; writes docs/pictures/interface_theory.png.

    python scripts/studies/interface_figure.py [--fast] [--json FILE] [--picture FILE]

Three panels: a wave from a bar of zones into a chain of discs of another impedance, (Z1 - Z2)/(Z1 + Z2); a short wave at equal
impedances, with the half disc's mass at the rim and without it, where (m/4Z) du/dt comes back; a disc on the end of a bar,
e = exp(-pi b / sqrt(1 - b^2)). The bars of scripts/verification/coupling (waves.py, restitution.py). --fast: fewer points.
"""

import argparse
import json
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # what the scripts share

from verification.coupling import restitution, waves

from colluvium.figures.style import styled

PICTURE = Path(__file__).resolve().parents[2] / "docs" / "pictures" / "interface_theory.png"
RATIOS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 10.0)
WIDTHS = (4.0, 6.0, 9.0, 12.0, 18.0)  # standard deviations of the pulse in zones
DAMPING = (0.05, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8)  # b = sqrt(k m) / 2 Z
COLUMNS_TO_CONTACT = 40  # zones in c / omega of the disc's contact


def impedance(ratio):
    """Closed form of what comes back."""
    return (1.0 - ratio) / (1.0 + ratio)


def missing_mass(width):
    """Largest (m/4Z) du/dt over the pulse, a Gaussian of `width` zones, m = rho dx^2: exp(-1/2) / 4 width."""
    return np.exp(-0.5) / (4.0 * width)


def measure(fast):
    """Rows: panel, curve, place on the axis, measured and predicted value."""

    def some(values):
        return values[:: len(values) // 2] if fast else values

    rows = []
    for ratio in some(RATIOS):
        rows.append(("impedance", "half disc's mass at the rim", ratio, waves.reflected(ratio)[0], impedance(ratio)))
    for half_mass, name in ((False, "without it"), (True, "half disc's mass at the rim")):
        for width in some(WIDTHS):
            found = abs(waves.reflected(1.0, width, half_mass)[0])
            rows.append(("pulse", name, width, found, 0.0 if half_mass else missing_mass(width)))
    for b in some(DAMPING):
        rows.append(("impact", "disc", b, restitution.rebound(b, COLUMNS_TO_CONTACT)[0], restitution.restitution(b)))
    return [dict(zip(("panel", "curve", "at", "measured", "predicted"), map(_plain, row), strict=True)) for row in rows]


def _plain(value):
    return value if isinstance(value, str) else float(value)


@styled
def draw(rows, path):
    """Lines are predictions, marks what was measured."""
    import matplotlib.pyplot as plt

    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(10.2, 3.2), layout="constrained")
    ratio, width, b = np.geomspace(0.08, 12.0, 200), np.geomspace(3.5, 20.0, 50), np.linspace(0.0, 0.9, 100)
    left.semilogx(ratio, impedance(ratio), color="#b0b0b0")
    middle.loglog(width, 100.0 * missing_mass(width), color="#b0b0b0")
    right.plot(b, restitution.restitution(b), color="#b0b0b0")
    _marks(left, rows, "impedance", 1.0)
    _marks(middle, rows, "pulse", 100.0)
    _marks(right, rows, "impact", 1.0)
    left.set(title="wave into discs: what comes back", xlabel="impedance of discs over zones", ylabel="amplitude over the pulse")
    middle.set(title="equal impedances: what comes back [%]", xlabel="standard deviation of the pulse [zones]")
    middle.legend(fontsize=7.0)
    middle.set_xticks(WIDTHS, [f"{value:g}" for value in WIDTHS])
    middle.minorticks_off()
    right.set(title="disc on a bar: coefficient of restitution", xlabel="b = $\\sqrt{km}$ / 2Z")
    figure.savefig(path)
    plt.close(figure)


def _marks(axes, rows, panel, scale):
    own = [row for row in rows if row["panel"] == panel]
    for name, colour in zip(dict.fromkeys(row["curve"] for row in own), ("#d0472f", "#123a5e"), strict=False):
        some = [row for row in own if row["curve"] == name]
        at, measured = ([row[key] for row in some] for key in ("at", "measured"))
        axes.plot(at, scale * np.array(measured), "o", color=colour, label=name, markersize=4)


def main(argv=None):
    """Measure, print, draw."""
    parser = argparse.ArgumentParser(description=__doc__.partition(";")[0])
    parser.add_argument("--fast", action="store_true", help="three points a curve")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the rows to FILE")
    parser.add_argument("--picture", metavar="FILE", type=Path, default=PICTURE)
    options = parser.parse_args(argv)
    rows = measure(options.fast)
    for row in rows:
        values = f"measured {row['measured']:9.5f}  predicted {row['predicted']:9.5f}"
        print(f"{row['panel']:<10} {row['curve']:<28} {row['at']:6g}  {values}")
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    draw(rows, options.picture)


if __name__ == "__main__":
    main()
