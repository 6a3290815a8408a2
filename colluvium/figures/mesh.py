"""Geometry of the slope, its mesh, and the window with its ring of control discs."""

from typing import Any

import numpy as np

from colluvium.figures import domain, style
from colluvium.results.run import Run
from colluvium.results.window_fields import outline_of, starting_places

GROUND, RING, DISC, LINES = "#ece6da", "#d0472f", "#9fb4c7", "#6f7780"
TINTS = (GROUND, "#d8d2e2", "#cfe0d2", "#f0d9c9")  # of the materials, repeated if there are more


def missing(run: Run) -> str:
    """Text of the missing data: a continuum. "" if there is one."""
    return "" if run.recorded(0) else "no frame of the continuum"


@style.styled
def draw(run: Run) -> Any:
    """Draws the slope with dimensions and windows; zones, control discs and discs at the start; a corner of the first window."""
    import matplotlib.pyplot as plt

    own = [i for i in range(len(run.frames)) if run.has(i, 0)]
    first = {rank: next(i for i in range(len(run.frames)) if run.has(i, rank)) for rank in run.windows}
    holes = [i for i in own if i > max(first.values())] if first else own
    columns = 3 if first else 2
    ratios = (2.0, 2.0, 1.0)[:columns]
    figure, axes = plt.subplots(1, columns, figsize=(style.PAGE, 2.6), width_ratios=ratios, layout="compressed")
    _geometry(run, own[0], first, axes[0])
    for place in axes[1:]:
        _mesh(run, (holes or own)[0], first, place)
    if first:
        _corner(run, (holes or own)[0], first, axes[2])
    return figure


def _geometry(run: Run, frame: int, first: dict[int, int], axes: Any) -> None:
    """Draws materials, length and height, and the windows as hatched boxes with their sides."""
    from matplotlib.collections import PolyCollection

    zones, xy = run.zones(frame), run.gridpoints(frame).xy
    filled = domain.fill_polygons(axes, xy[zones.corners], GROUND)
    if "group" in zones:
        filled.set_color([TINTS[int(group) % len(TINTS)] for group in zones.group])
    domain.outline(axes, xy, zones.corners)
    for rank, i in first.items():
        outline = outline_of(run, i, rank)
        width, height = np.ptp(outline, axis=0)
        axes.add_collection(PolyCollection([outline], facecolors="none", edgecolors=RING, hatch="///", linewidths=0.8))
        low, high = outline.min(axis=0), outline.max(axis=0)
        words = f"{width:.3g} x {height:.3g} m"
        axes.annotate(words, (0.5 * (low[0] + high[0]), low[1]), (0, -4), textcoords="offset points", ha="center", va="top")
    low, high = xy[zones.corners.ravel()].min(axis=0), xy[zones.corners.ravel()].max(axis=0)
    domain.finish(axes, f"geometry: {high[0] - low[0]:.4g} m long, {high[1] - low[1]:.4g} m high{_steepness(run)}")


def _steepness(run: Run) -> str:
    """Text with the steepest part of a slope's surface."""
    profile = np.array((run.scene.get("grid") or {}).get("profile") or (), dtype=float).reshape(-1, 2)
    if len(profile) < 2:
        return ""
    rise = np.diff(profile, axis=0)
    return f", face at {np.degrees(np.abs(np.arctan2(rise[:, 1], rise[:, 0]))).max():.3g}°"


def _mesh(run: Run, frame: int, first: dict[int, int], axes: Any) -> None:
    """Draws the zones of a frame, and the discs at their initial positions."""
    zones, xy = run.zones(frame), run.gridpoints(frame).xy
    mesh = domain.fill_polygons(axes, xy[zones.corners], "#ffffff")
    mesh.set(edgecolor=LINES, linewidth=0.3)
    triangles = int((zones.corners[:, 2] == zones.corners[:, 3]).sum())
    counts = f"{len(zones.corners) - triangles:,} quadrilaterals, {triangles:,} triangles"
    for rank, i in first.items():
        discs = run.discs(i, rank)
        start = starting_places(discs)
        control = discs.control == 1 if "control" in discs else np.zeros(len(start), dtype=bool)
        domain.fill_discs(axes, start[~control], discs.radius[~control], DISC)
        domain.fill_discs(axes, start[control], discs.radius[control], RING)
    domain.outline(axes, xy, zones.corners)
    domain.finish(axes, f"mesh: {counts}")


def _corner(run: Run, frame: int, first: dict[int, int], axes: Any) -> None:
    """Draws the lower left corner of the first window, six zones wide."""
    from matplotlib.patches import Patch

    rank, i = next(iter(first.items()))
    discs = run.discs(i, rank)
    control = int((discs.control == 1).sum()) if "control" in discs else 0
    outline = outline_of(run, i, rank)
    corner = outline[outline.sum(axis=1).argmin()]
    edges = run.gridpoints(frame).xy[run.zones(frame).corners[:, :2]]
    side = 3.0 * float(np.median(np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)))
    axes.set_xlim(corner[0] - side, corner[0] + side)
    axes.set_ylim(corner[1] - side, corner[1] + side)
    axes.set_title("corner of the window")
    axes.tick_params(labelleft=True)
    handles = [
        Patch(color=RING, label=f"{control:,} control discs"),
        Patch(color=DISC, label=f"{len(discs.radius) - control:,} discs"),
    ]
    axes.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0)
