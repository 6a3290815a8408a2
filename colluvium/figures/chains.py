"""Force chains: every contact a line as wide as its normal force."""

from typing import Any

import numpy as np

from colluvium import stones
from colluvium.figures import domain, frames, style
from colluvium.results import Run

WIDEST = 3.0  # points, where the force is as large as in the strongest contact but 0.5 % of them
PART = 0.995
PANELS = 4
COMPRESSION, TENSION = "#123a5e", "#d0472f"
KINDS = ((COMPRESSION, "compression"), (TENSION, "tension in a bond"))


def applies(run: Run) -> bool:
    """Discs were recorded."""
    return bool(run.windows)


@style.styled
def draw(run: Run) -> Any:
    """The first window at the ends of its stages; each panel says which force its widest lines carry."""
    import matplotlib.pyplot as plt
    from matplotlib.lines import Line2D

    rank = run.windows[0]
    moments = frames.last_of_stages(run, rank, PANELS)
    figure, axes = plt.subplots(1, len(moments), figsize=(1.0 + 3.4 * len(moments), 7.0), squeeze=False, layout="compressed")
    for place, frame in zip(axes[0], moments, strict=True):
        strongest = _strong(run, frame, rank)
        _draw_window(run, frame, rank, place, strongest)
        info = run.frames[frame]
        factor, unit = style.readable("N", np.array([strongest]))
        domain.finish(
            place,
            f"{info.stage}, {info.gravity_factor:.3g} g\nstep {info.step:,}\n"
            f"widest line {factor * strongest:.3g} {unit}",
        )
        place.tick_params(labelleft=True)
    lines = [Line2D([], [], color=colour, label=words) for colour, words in KINDS]
    figure.legend(handles=lines, loc="outside lower center", ncols=2, title="normal contact force per m thickness")
    return figure


def _draw_window(run: Run, frame: int, rank: int, axes: Any, strongest: float) -> None:
    from matplotlib.collections import LineCollection

    discs, contacts = run.discs(frame, rank), run.contacts(frame, rank)
    domain.fill_discs(axes, discs.xy, discs.radius, "#e9e6e1")
    force = contacts.normal_force
    order = np.argsort(np.abs(force))  # the strongest on top
    width = WIDEST * np.minimum(np.abs(force[order]) / strongest, 1.0)
    colours = np.where(force[order] >= 0.0, COMPRESSION, TENSION)
    axes.add_collection(LineCollection(discs.xy[contacts.ends[order]], linewidths=width, colors=list(colours), capstyle="round"))
    domain.stone_outlines(axes, stones.outlines(run, frame, rank))


def _strong(run: Run, frame: int, rank: int) -> float:
    force = np.abs(run.contacts(frame, rank).normal_force)
    return float(np.quantile(force, PART)) if len(force) else 1.0
