"""Pictures of a laboratory: curves of all trials of a sample, and strengths with their lines."""

from pathlib import Path
from typing import Any

import numpy as np

from colluvium.figures import style
from colluvium.lab.curves import Curve
from colluvium.lab.strength import Line, strength_on
from colluvium.lab.trials import Trial

COLOURS = ("#1b6ca8", "#c1443c", "#3f8f4f", "#8a5aa8", "#c98a1b", "#4d4d4d")
ENERGY = ("energy", "energy", "kJ/m3", 1e3)
PANELS = {  # of a kind: columns over strain, with label, unit and size
    "biaxial": (("axial", "axial stress", "kPa", 1e3), ("volume", "volume strain", "%", 0.01), ENERGY),
    "shear": (("axial", "shear stress", "kPa", 1e3), ("volume", "rise over height", "%", 0.01), ENERGY),
    "oedometer": (("axial", "axial stress", "kPa", 1e3), ("side", "side stress", "kPa", 1e3), ENERGY),
    "brazilian": (("axial", "force over diameter", "kPa", 1e3), ("bonds_broken", "broken bonds", "", 1.0), ENERGY),
}
ENERGIES = (("work", "-"), ("stored", "--"), ("lost", ":"))


def write(kind: str, found: dict[str, Any], trials: list[Trial], curves: dict[str, Curve], out: Path) -> list[Path]:
    """Draws all pictures of a laboratory into `out`; returns their paths."""
    paths = []
    for sample in found["samples"]:
        own = [trial for trial in trials if trial.sample == sample and trial.name in curves]
        paths.append(_save(draw_curves(kind, own, curves), out / f"{sample}_curves.png"))
        if found["samples"][sample].get("peak"):
            rows = [row for row in found["trials"] if row["sample"] == sample and row["factor"] == 1.0]
            paths.append(_save(draw_strength(kind, found["samples"][sample], rows), out / f"{sample}_strength.png"))
    return paths


def _save(figure: Any, path: Path) -> Path:
    import matplotlib.pyplot as plt

    figure.savefig(path)
    plt.close(figure)
    return path


@style.styled
def draw_curves(kind: str, trials: list[Trial], curves: dict[str, Curve]) -> Any:
    """Draws the panels of a kind: a colour for each stress, thin lines for the seeds, dashed at another rate."""
    import matplotlib.pyplot as plt

    panels = PANELS[kind]
    figure, axes = plt.subplots(1, len(panels), figsize=(style.PAGE, 2.7), layout="constrained")
    pressures = sorted({trial.pressure for trial in trials})
    for place, (name, label, unit, size) in zip(axes, panels, strict=True):
        for trial in trials:
            colour = COLOURS[pressures.index(trial.pressure) % len(COLOURS)]
            _draw_panel(place, curves[trial.name], name, size, colour, trial)
        place.set_xlabel("displacement over height [%]" if kind == "shear" else "axial strain [%]")
        place.set_ylabel(f"{label} [{unit}]" if unit else label)
        place.grid(color=style.PALE, linewidth=0.3)
    for pressure in pressures if pressures != [0.0] else ():
        axes[0].plot([], [], color=COLOURS[pressures.index(pressure) % len(COLOURS)], label=f"{pressure / 1e3:g} kPa")
    for name, line in ENERGIES:
        axes[-1].plot([], [], line, color=style.INK, label=name)
    axes[-1].legend()
    if pressures != [0.0]:
        axes[0].legend()
    return figure


def _draw_panel(place: Any, curve: Curve, name: str, size: float, colour: str, trial: Trial) -> None:
    x = 100.0 * (curve["wall_strain"] if trial.kind == "brazilian" else curve["strain"])
    lines = ENERGIES if name == "energy" else ((name, "-" if trial.factor == 1.0 else "--"),)
    for column, line in lines:
        place.plot(x, curve[column] / size, line, color=colour, linewidth=0.7)


@style.styled
def draw_strength(kind: str, own: dict[str, Any], rows: list[dict[str, Any]]) -> Any:
    """Draws peak and residual strength of all trials over the side or normal stress, with their lines in the window."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(0.5 * style.PAGE, 2.9), layout="constrained")
    for when, colour in zip(("peak", "residual"), COLOURS, strict=False):
        side, axial = (np.array([row[f"{when}_{name}"] for row in rows]) for name in ("side", "axial"))
        axes.plot(side / 1e3, axial / 1e3, ".", color=colour)
        if not (line := own[when]):
            continue
        ends = np.array(line["window"])
        label = f"{when}: c {line['c'] / 1e3:.1f} kPa, phi {line['phi']:.1f} deg"
        axes.plot(
            ends / 1e3, strength_on(kind, Line(line["c"], line["phi"]), ends) / 1e3, color=colour, linewidth=1.0, label=label
        )
    axes.set_xlabel("normal stress [kPa]" if kind == "shear" else "smaller principal stress [kPa]")
    axes.set_ylabel("shear strength [kPa]" if kind == "shear" else "larger principal stress [kPa]")
    axes.set_xlim(left=0.0)
    axes.set_ylim(bottom=0.0)
    axes.grid(color=style.PALE, linewidth=0.3)
    axes.legend()
    return figure
