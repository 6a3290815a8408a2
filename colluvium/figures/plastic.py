"""Zones that yield now or have yielded, and broken contact bonds."""

from typing import Any

import numpy as np

from colluvium.figures import domain, frames, style
from colluvium.results.run import Run
from colluvium.results.window_fields import starting_places

STATES = (  # bits of plastic_state in order of precedence, text, colour
    (2, "tension now", "#d55e00"),
    (1, "shear now", "#7a0403"),
    (8, "tension past", "#f3c188"),
    (4, "shear past", "#d9a3a3"),
)
ELASTIC = "#eef1f4"


def missing(run: Run) -> str:
    """Text of the missing data: zones that can yield. "" if there are any."""
    if not run.recorded(0):
        return "no frame of the continuum"
    return "" if "plastic_state" in run.zones(frames.last(run, 0)) else "no zone can yield"


@style.styled
def draw(run: Run) -> Any:
    """Draws zones coloured by state, and broken bonds as dots, in the last frame."""
    import matplotlib.pyplot as plt
    from matplotlib.patches import Patch

    frame = frames.last(run, 0)
    figure, axes = plt.subplots(figsize=(style.PAGE, 3.9), layout="compressed")
    zones, xy = run.zones(frame), run.gridpoints(frame).xy
    shown = [Patch(color=colour, label=words) for _, words, colour in STATES]
    shown.append(Patch(color=ELASTIC, label="never yielded"))
    filled = domain.fill_polygons(axes, xy[zones.corners], ELASTIC)
    filled.set_color(colours_of(zones.plastic_state))
    for rank in run.windows:
        if run.has(frame, rank):
            shown += _broken_bonds(run, frame, rank, axes)
    domain.outline(axes, xy, zones.corners)
    domain.finish(axes, f"plastic zones: {style.moment(run.frames[frame])}")
    axes.legend(handles=shown, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0)
    return figure


def colours_of(plastic_state: np.ndarray) -> list[str]:
    """Colour of each zone (Z,) by the first of STATES that applies."""
    colours = np.full(len(plastic_state), ELASTIC, dtype=object)
    for bit, _, colour in reversed(STATES):
        colours[(plastic_state & bit) > 0] = colour
    return list(colours)


def _broken_bonds(run: Run, frame: int, rank: int, axes: Any) -> list[Any]:
    contacts = run.contacts(frame, rank)
    if "bond_state" not in contacts:
        return []
    broken = contacts.bond_state >= 2
    middle = starting_places(run.discs(frame, rank))[contacts.ends[broken]].mean(axis=1)
    label = f"broken bonds still in contact: {broken.sum():,}"
    return axes.plot(*middle.T, ".", markersize=1.0, color=style.INK, label=label)
