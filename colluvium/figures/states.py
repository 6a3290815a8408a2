"""Shear strain in the frames in which the band reaches its four states, on a scale that shows where it counts."""

from typing import Any

import numpy as np

from colluvium import states
from colluvium.figures import domain, style
from colluvium.results import Run
from colluvium.window_fields import bins, shear_strain

DECADE = 10.0  # either side of the strain from which on a state counts


def applies(run: Run) -> bool:
    """A band and a window were recorded under overload."""
    kinds = {stage["name"]: stage["kind"] for stage in run.scene.get("stage", ())}
    return bool(run.windows) and run.recorded(0) and any(kinds.get(name) == "overload" for name in run.stages)


def moments(run: Run) -> list[tuple[str, int]]:
    """Titles and frames: the last one before the band enters, then each frame in which one or more states are reached."""
    found = states.reaches(run)
    before = states.last_before(found)
    shown = [("a, last frame", before.frame)] if before else []
    for one in states.states(found)[1:]:
        if one.reach and one.reach.frame not in [frame for _, frame in shown]:
            letters = "".join(sorted(one.letter + one.alike))
            shown.append((", ".join(f"{letter} {states.MEANING[letter]}" for letter in letters), one.reach.frame))
    return shown


@style.styled
def draw(run: Run) -> Any:
    """One axes a moment, strains logarithmic; zones move with their gridpoints, bins stay where they were."""
    import matplotlib.pyplot as plt
    from matplotlib.colors import LogNorm

    shown = moments(run)
    figure, axes = plt.subplots(1, len(shown), figsize=(4.6 * len(shown), 3.6), sharey=True, squeeze=False, layout="compressed")
    colours = {"norm": LogNorm(states.COUNTED / DECADE, states.COUNTED * DECADE), "cmap": style.colour_map("strain")}
    for place, (title, frame) in zip(axes.flat, shown, strict=True):
        zones, xy = run.zones(frame), domain.gridpoints_now(run, frame)
        drawn = domain.fill_polygons(place, xy[zones.corners], np.maximum(zones.shear_strain, 1e-9), **colours)
        for rank in run.windows:
            grid = bins(run, frame, rank)
            inside = shear_strain(run, frame, grid, rank)
            known = np.isfinite(inside)
            domain.fill_polygons(place, grid.rectangles[known], np.maximum(inside[known], 1e-9), **colours)
        domain.outline(place, xy, zones.corners)
        domain.finish(place, f"{title}\n{style.moment(run.frames[frame])}")
    domain.colour_bar(figure, drawn, axes, f"shear strain [{run.units('shear_strain')}]", extend="both")
    return figure
