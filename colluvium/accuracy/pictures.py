"""Error against seconds of all settings of a study, with their front and the target."""

from itertools import groupby
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from colluvium.accuracy.answer import Point
from colluvium.accuracy.knobs import Knob


def write(quantity: str, points: list[Point], knobs: list[Knob], target: float, path: Path) -> None:
    """Draws the picture: one curve for each setting of all knobs but the first, which runs along the curve."""
    figure, axes = plt.subplots(figsize=(6.4, 4.4), layout="constrained")
    along = knobs[0].name
    known = [p for p in points if p.error is not None and p.seconds]

    def others(point: Point) -> str:
        return ", ".join(f"{name} = {value:g}" if isinstance(value, float) else f"{name} = {value}"
                         for name, value in point.values.items() if name != along)  # fmt: skip

    for label, group in groupby(sorted(known, key=others), key=others):
        own = sorted(group, key=lambda p: p.seconds or 0.0)
        errors = [100.0 * max(p.error or 0.0, 1e-12) for p in own]
        axes.loglog([p.seconds for p in own], errors, marker="o", markersize=4, linewidth=1.2, label=label or along)
    front = sorted((p.seconds, 100.0 * max(p.error or 0.0, 1e-12)) for p in known if p.on_front)
    if front:
        axes.loglog(*zip(*front, strict=True), color="black", linewidth=2.6, alpha=0.25, label="front: nothing cheaper is better")
    axes.axhline(100.0 * target, color="#b03a2e", linewidth=1.0, linestyle="--", label=f"target {100 * target:g} %")
    failed = [p.name for p in points if p.failed]
    if failed:
        axes.set_title(f"failed: {'; '.join(failed)}", fontsize=8, color="#b03a2e")
    axes.set_xlabel("seconds of the stages")
    axes.set_ylabel(f"error of {quantity} [%]")
    axes.grid(True, which="major", color="#e4e4e4", linewidth=0.6)
    axes.legend(fontsize=8)
    figure.savefig(path, dpi=150)
    plt.close(figure)
