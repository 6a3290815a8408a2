"""Force chains: every contact as a line; its width grows with the root of its normal force, on one scale for all panels.

    width = WIDEST sqrt(force / F)

Chains (colluvium/results/force_chains.py) lie under the contacts as broad bands; the title has their number, their share of the
bodies and their direction.

F: force that 0.5 % of the contacts exceed, in the panel where it is largest. With the root, a hundredth of F has a tenth of the
width, so that a panel with low forces is not empty.
"""

from typing import Any

import numpy as np

from colluvium.figures import domain, frames, moments, style
from colluvium.results.force_chains import ForceChains
from colluvium.results.run import Run

WIDEST, THINNEST = 3.0, 0.15  # [pt]
PART = 0.995
APART = 2.0  # drawn distance over the sum of radii, beyond which a contact has no line: discs met in a run-out
COMPRESSION, TENSION, CHAIN = "#123a5e", "#d0472f", "#e8a33d"
CHAIN_WIDTH = 4.0  # [pt]
KEYS = (1.0, 0.1, 0.01)  # parts of F in the key
KINDS = ((COMPRESSION, "compression"), (TENSION, "tension in a bond"))


def missing(run: Run, rank: int | None = None) -> str:
    """Text of the missing data: discs. "" if there are any."""
    return "" if run.windows else "no frame of discs"


@style.styled
def draw(run: Run, rank: int | None = None) -> Any:
    """Draws a window (none: the first) in each state of the band, or at the ends of stages, with a key of forces."""
    from matplotlib.lines import Line2D

    rank = run.windows[0] if rank is None else rank
    shown = moments.of_run(run, rank, frames.last_of_stages)
    seen = np.concatenate([domain.discs_now(run, moment.frame, rank) for moment in shown])
    figure, axes = domain.panels(len(shown), seen)
    strongest = max(_strong(run, moment.frame, rank) for moment in shown)
    for place, moment in zip(axes, shown, strict=True):
        found = _draw_window(run, moment.frame, rank, place, strongest)
        domain.finish(place, f"{moments.title(run, moment)}{frames.note(run, moment.frame)}\n{in_words(found)}")
    factor, unit = style.readable("N", np.array([strongest]))
    lines = [
        Line2D([], [], color=COMPRESSION, linewidth=float(width_of(part, 1.0)), label=f"{factor * part * strongest:.3g} {unit}")
        for part in KEYS
    ]
    lines += [Line2D([], [], color=colour, label=words) for colour, words in KINDS]
    lines += [Line2D([], [], color=CHAIN, linewidth=CHAIN_WIDTH, label="chain")]
    words = "normal contact force per m thickness, one scale for all panels"
    figure.legend(handles=lines, loc="outside lower center", ncols=len(lines), title=words)
    return figure


def width_of(force: Any, strongest: float) -> np.ndarray:
    """Line widths [pt] of normal forces [N]; contacts without force have no line."""
    share = np.sqrt(np.minimum(np.abs(force) / strongest, 1.0))
    return np.where(share > 0.0, np.maximum(WIDEST * share, THINNEST), 0.0)


def in_words(found: ForceChains) -> str:
    """Number, share and direction of chains."""
    if not found.chains:
        return "no chains"
    return f"{found.chains} chains, {found.share:.0%} of the bodies, {found.direction:.0f}° (agreement {found.agreement:.2f})"


def _draw_window(run: Run, frame: int, rank: int, axes: Any, strongest: float) -> ForceChains:
    """Draws a window; returns its chains."""
    from matplotlib.collections import LineCollection

    discs, contacts = run.discs(frame, rank), run.contacts(frame, rank)
    xy, ends, found = domain.discs_now(run, frame, rank), contacts.ends, run.force_chains(frame, rank)
    domain.fill_discs(axes, xy, discs.radius, "#e9e6e1")
    axes.add_collection(LineCollection(xy[found.links], linewidths=CHAIN_WIDTH, colors=CHAIN, capstyle="round"))
    apart = np.linalg.norm(np.diff(xy[ends], axis=1)[:, 0], axis=1) > APART * discs.radius[ends].sum(axis=1)
    ends, force = ends[~apart], contacts.normal_force[~apart]
    order = np.argsort(np.abs(force))  # the strongest on top
    width = width_of(force[order], strongest)
    colours = np.where(force[order] >= 0.0, COMPRESSION, TENSION)
    axes.add_collection(LineCollection(xy[ends[order]], linewidths=width, colors=list(colours), capstyle="round"))
    domain.stone_outlines(axes, domain.stones_now(run, frame, rank))
    domain.draw_walls(axes, run, frame)
    return found


def _strong(run: Run, frame: int, rank: int) -> float:
    force = np.abs(run.contacts(frame, rank).normal_force)
    return float(np.quantile(force, PART)) if len(force) else 1.0
