"""Force chains: every contact as a line whose width is its normal force."""

from typing import Any

import numpy as np

from colluvium.figures import domain, frames, moments, style
from colluvium.results.run import Run

WIDEST = 3.0  # points, for the force that 0.5 % of the contacts exceed
PART = 0.995
APART = 2.0  # drawn distance over the sum of radii, beyond which a contact has no line: discs met in a run-out
COMPRESSION, TENSION = "#123a5e", "#d0472f"
KINDS = ((COMPRESSION, "compression"), (TENSION, "tension in a bond"))


def missing(run: Run) -> str:
    """Text of the missing data: discs. "" if there are any."""
    return "" if run.windows else "no frame of discs"


@style.styled
def draw(run: Run) -> Any:
    """Draws the first window in each state of the band, or at the ends of stages; titles give the force of the widest line."""
    from matplotlib.lines import Line2D

    rank = run.windows[0]
    shown = moments.of_run(run, rank, frames.last_of_stages)
    seen = np.concatenate([domain.discs_now(run, moment.frame, rank) for moment in shown])
    figure, axes = domain.panels(len(shown), seen)
    for place, moment in zip(axes, shown, strict=True):
        strongest = _strong(run, moment.frame, rank)
        _draw_window(run, moment.frame, rank, place, strongest)
        factor, unit = style.readable("N", np.array([strongest]))
        domain.finish(
            place, f"{moments.title(run, moment)}{frames.note(run, moment.frame)}\nwidest line {factor * strongest:.3g} {unit}"
        )
    lines = [Line2D([], [], color=colour, label=words) for colour, words in KINDS]
    figure.legend(handles=lines, loc="outside lower center", ncols=2, title="normal contact force per m thickness")
    return figure


def _draw_window(run: Run, frame: int, rank: int, axes: Any, strongest: float) -> None:
    from matplotlib.collections import LineCollection

    discs, contacts = run.discs(frame, rank), run.contacts(frame, rank)
    xy, ends = domain.discs_now(run, frame, rank), contacts.ends
    domain.fill_discs(axes, xy, discs.radius, "#e9e6e1")
    apart = np.linalg.norm(np.diff(xy[ends], axis=1)[:, 0], axis=1) > APART * discs.radius[ends].sum(axis=1)
    ends, force = ends[~apart], contacts.normal_force[~apart]
    order = np.argsort(np.abs(force))  # the strongest on top
    width = WIDEST * np.minimum(np.abs(force[order]) / strongest, 1.0)
    colours = np.where(force[order] >= 0.0, COMPRESSION, TENSION)
    axes.add_collection(LineCollection(xy[ends[order]], linewidths=width, colors=list(colours), capstyle="round"))
    domain.stone_outlines(axes, domain.stones_now(run, frame, rank))
    domain.draw_walls(axes, run, frame)


def _strong(run: Run, frame: int, rank: int) -> float:
    force = np.abs(run.contacts(frame, rank).normal_force)
    return float(np.quantile(force, PART)) if len(force) else 1.0
