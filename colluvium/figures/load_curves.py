"""Load against settlement of moved boundaries, and stress against strain between walls."""

from typing import Any

import numpy as np

from colluvium.figures import style
from colluvium.figures.histories import COLOURS
from colluvium.results import load_curves
from colluvium.results.run import Run


def missing(run: Run) -> str:
    """Text of the missing data: a boundary or wall that is moved and loaded. "" if there is one."""
    return "" if load_curves.curves(run) else "no boundary or wall is moved"


@style.styled
def draw(run: Run) -> Any:
    """Draws one axes for each motion, at most two in a row."""
    import matplotlib.pyplot as plt

    found = load_curves.curves(run)
    columns = min(len(found), 2)
    rows = -(-len(found) // columns)
    figure, axes = plt.subplots(
        rows, columns, figsize=(style.PAGE * columns / 2, 2.9 * rows), squeeze=False, layout="constrained"
    )
    for place, curve in zip(axes.flat, found, strict=False):
        factor, unit = style.readable(curve.y_unit, *curve.y.values())
        across, x_unit = style.readable(curve.x_unit, curve.x)
        for colour, (name, values) in zip(np.resize(COLOURS, len(curve.y)), curve.y.items(), strict=True):
            place.plot(across * curve.x, factor * values, color=str(colour), linewidth=1.0, label=name)
        place.set_title(curve.title)
        place.set_xlabel(f"{curve.x_label} [{x_unit}]")
        place.set_ylabel(f"{curve.y_label} [{unit}]")
        place.grid(color=style.PALE, linewidth=0.3)
        if len(curve.y) > 1:
            place.legend()
    for place in list(axes.flat)[len(found) :]:
        place.set_axis_off()
    return figure
