"""Pictures of a search for a factor of safety: mechanism, plastic zones, motion in all trials, value over zone size."""

from pathlib import Path
from typing import Any

import numpy as np

from colluvium.figures import domain, plastic, style
from colluvium.results.run import Run, open_run
from coupler_protocol.files import run_json

COLOURS = {"rests": "#2f6f9f", "fails": "#b03a2e", "undecided": "#8a8a8a"}
ARROWS = 22  # number across the longer side


def write(out: str | Path) -> list[Path]:
    """Draws all pictures of a folder of `colluvium fos`; returns the files."""
    import matplotlib.pyplot as plt

    out = Path(out)
    found = run_json.read_search(out / "fos.json")
    finest = found["meshes"][-1]
    drawn = {"trials": draw_trials(found)}
    failed = [t for t in finest["trials"] if t["verdict"] == "fails"]
    if failed:
        first = min(failed, key=lambda t: t["factor"])
        with open_run(out / f"mesh{len(found['meshes'])}") as run:
            title = f"{found['quantity']} {finest['value']:.3f}, at {first['factor']:.4g}"
            drawn["mechanism"] = draw_mechanism(run, first["frame"], title)
            drawn["plastic_zones"] = draw_plastic(run, first["frame"], title)
    if len(found["meshes"]) > 1:
        drawn["meshes"] = draw_meshes(found)
    for name, figure in drawn.items():
        figure.savefig(out / f"{name}.png")
        plt.close(figure)
    return [out / f"{name}.png" for name in drawn]


@style.styled
def draw_mechanism(run: Run, frame: int, title: str) -> Any:
    """Draws the shear strain rate over its largest value, logarithmic over two decades, and velocities as arrows."""
    import matplotlib.pyplot as plt
    from matplotlib.colors import LogNorm

    zones, points = run.zones(frame), run.gridpoints(frame)
    rate = zones.shear_strain_rate / max(zones.shear_strain_rate.max(), 1e-300)
    figure, axes = plt.subplots(figsize=_fitting(points.xy), layout="constrained")
    drawn = domain.fill_polygons(
        axes, points.xy[zones.corners], np.maximum(rate, 1e-2), norm=LogNorm(1e-2, 1.0), cmap=style.colour_map("rate")
    )
    chosen = _spread_out(points.xy)
    velocity = points.velocity / max(np.hypot(*points.velocity.T).max(), 1e-300)
    chosen = chosen[np.hypot(*velocity[chosen].T) > 0.02]
    axes.quiver(*points.xy[chosen].T, *velocity[chosen].T, color=style.INK, width=0.0018, scale=ARROWS)
    domain.outline(axes, points.xy, zones.corners)
    domain.finish(axes, f"mechanism: {title}")
    domain.colour_bar(figure, drawn, axes, "shear strain rate over its largest [-]")
    return figure


@style.styled
def draw_plastic(run: Run, frame: int, title: str) -> Any:
    """Draws zones by their plastic state."""
    import matplotlib.pyplot as plt
    from matplotlib.patches import Patch

    zones, xy = run.zones(frame), run.gridpoints(frame).xy
    figure, axes = plt.subplots(figsize=_fitting(xy), layout="constrained")
    filled = domain.fill_polygons(axes, xy[zones.corners], plastic.ELASTIC)
    filled.set_color(plastic.colours_of(zones.plastic_state))
    domain.outline(axes, xy, zones.corners)
    domain.finish(axes, f"plastic zones: {title}")
    shown = [Patch(color=colour, label=words) for _, words, colour in plastic.STATES]
    shown.append(Patch(color=plastic.ELASTIC, label="never yielded"))
    figure.legend(handles=shown, loc="outside lower center", ncols=len(shown))
    return figure


@style.styled
def draw_trials(found: dict[str, Any]) -> Any:
    """Draws motion of each span and unbalanced ratio over the steps, for all trials of the finest mesh."""
    import matplotlib.pyplot as plt
    from matplotlib.ticker import NullFormatter

    mesh = found["meshes"][-1]
    figure, axes = plt.subplots(1, 2, figsize=(9.0, 3.6), sharex=True, layout="compressed")
    for trial in sorted(mesh["trials"], key=lambda t: t["factor"]):
        steps = mesh["span"] * np.arange(1, len(trial["spans"]["ratio"]) + 1)
        colour = COLOURS[trial["verdict"]]
        for place, values in zip(axes, (trial["spans"]["motion"], trial["spans"]["ratio"]), strict=True):
            place.loglog(steps, values, color=colour, linewidth=0.9)
            place.annotate(f"{trial['factor']:.4g}", (steps[-1], values[-1]), fontsize=style.SMALLEST, color=colour)
    for place, label in zip(axes, ("rms displacement of a span [m]", "unbalanced ratio [-]"), strict=True):
        place.xaxis.set_minor_formatter(NullFormatter())
        place.set_xlabel("steps")
        place.set_ylabel(label)
        place.grid(color=style.PALE, linewidth=0.3)
    for verdict, colour in COLOURS.items():
        if any(t["verdict"] == verdict for t in mesh["trials"]):
            axes[0].plot([], [], color=colour, label=verdict)
    axes[0].legend()
    axes[0].set_title(f"trials on zones of {mesh['zone_size']:.4g} m")
    return figure


@style.styled
def draw_meshes(found: dict[str, Any]) -> Any:
    """Draws the factor over the zone size, with brackets, and its extrapolation."""
    import matplotlib.pyplot as plt

    size = np.array([m["zone_size"] for m in found["meshes"]])
    value = np.array([m["value"] for m in found["meshes"]])
    half = np.array([0.5 * (m["high"] - m["low"]) for m in found["meshes"]])
    extra = found["extrapolation"]
    figure, axes = plt.subplots(figsize=(5.5, 3.6), layout="compressed")
    axes.errorbar(size, value, half, fmt="o", color=style.INK, markersize=3, capsize=3, label="bracket")
    if extra["value"] is not None:
        h = np.linspace(0.0, size.max(), 200)
        slope = (value[-1] - extra["value"]) / size[-1] ** extra["order"]
        axes.plot(h, extra["value"] + slope * h ** extra["order"], color=style.PALE, linewidth=1.2)
        axes.errorbar([0.0], [extra["value"]], [extra["from_brackets"]], fmt="s", color="#b03a2e", markersize=4, capsize=3,
                      label=f"extrapolated {extra['value']:.3f}, order {extra['order']:.2f}")  # fmt: skip
    elif extra["low"] is not None:
        axes.plot([0.0, 0.0], [extra["low"], extra["high"]], color="#b03a2e", linewidth=2.0,
                  label=f"between {extra['low']:.3f} and {extra['high']:.3f}, order {extra['order']:.2f}")  # fmt: skip
    axes.set_xlabel("zone size [m]")
    axes.set_ylabel(found["quantity"])
    axes.set_title(found["title"])
    axes.legend()
    return figure


def _fitting(xy: np.ndarray) -> tuple[float, float]:
    """Size of a figure [in] for a drawing of equal scales around gridpoints (N, 2)."""
    width, height = np.ptp(xy, axis=0)
    return 8.0, 1.7 + 6.6 * height / width


def _spread_out(xy: np.ndarray) -> np.ndarray:
    """Indices of gridpoints that are about evenly distributed, one for each cell of a coarse net."""
    low, size = xy.min(axis=0), np.ptp(xy, axis=0).max() / ARROWS
    _, first = np.unique(np.floor((xy - low) / size).astype(int), axis=0, return_index=True)
    return first
