"""Pictures of a sweep: curve over the settings, distribution, mean with the number of seeds, bands over each other."""

import contextlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from colluvium.ensemble.answer import Setting, by_number_of_seeds, name_of
from colluvium.ensemble.study import Found
from colluvium.figures import domain
from colluvium.figures.style import INK, PALE, styled
from colluvium.results import band_line, failure
from colluvium.results.run import Run, open_run
from coupler_protocol import exits
from coupler_protocol.criteria import shear_band

MOST_MAPS = 12  # settings that get a panel of bands


def write(found: Sequence[Found], settings: Sequence[Setting], quantity: str, out: Path) -> list[Path]:
    """Draws the pictures that the results allow into `out`; returns their paths."""
    paths = []
    for name, figure in (
        ("curve.png", curve(settings, quantity)),
        ("distribution.png", distribution(settings, quantity)),
        ("seeds.png", settling(settings, quantity)),
        ("bands.png", bands(found, quantity)),
    ):
        if figure is not None:
            figure.savefig(out / name)
            paths.append(out / name)
    return paths


@styled
def curve(settings: Sequence[Setting], quantity: str) -> Any:
    """Every value, and means with their intervals, over the first key; one curve for each setting of the other keys."""
    from matplotlib.figure import Figure

    known = [one for one in settings if one.mean is not None]
    if not known or not known[0].values:
        return None
    figure = Figure(figsize=(4.6, 3.2), layout="constrained")
    axes = figure.subplots()
    key, groups = next(iter(known[0].values)), _by_other_keys(known)
    numeric = all(_is_number(one.values[key]) for one in known)
    places = {repr(value): i for i, value in enumerate(dict.fromkeys(repr(one.values[key]) for one in known))}
    for i, (label, group) in enumerate(groups.items()):
        x = np.array([float(one.values[key]) if numeric else places[repr(one.values[key])] for one in group])
        order = np.argsort(x)
        means = np.array([one.mean for one in group], dtype=float)
        colour = f"C{i}" if len(groups) > 1 else INK
        for place, one in zip(x, group, strict=True):
            axes.plot(np.full(len(one.found), place), one.found, ".", color=PALE, zorder=1)
            if one.interval:
                axes.plot([place, place], one.interval, color=colour, linewidth=2.0, solid_capstyle="butt", zorder=2)
        axes.plot(x[order], means[order], "o-", color=colour, markersize=4, linewidth=1.0, label=label, zorder=3)
    if not numeric:
        axes.set_xticks(range(len(places)), list(places))
    if len(groups) > 1:
        axes.legend()
    axes.set_xlabel(key)
    axes.set_ylabel(quantity)
    axes.set_title("mean with its 95 % interval; grey: each seed")
    return figure


@styled
def distribution(settings: Sequence[Setting], quantity: str) -> Any:
    """Share of the seeds with a smaller value, for each setting."""
    from matplotlib.figure import Figure

    known = [one for one in settings if len(one.found) > 1]
    if not known:
        return None
    figure = Figure(figsize=(4.6, 3.2), layout="constrained")
    axes = figure.subplots()
    for one in known:
        values = np.sort(one.found)
        axes.step(np.repeat(values, 1), np.arange(1, len(values) + 1) / len(values), where="post", label=name_of(one.values))
    axes.set_xlabel(quantity)
    axes.set_ylabel("share of the seeds with no more")
    axes.set_ylim(0.0, 1.0)
    axes.legend()
    return figure


@styled
def settling(settings: Sequence[Setting], quantity: str) -> Any:
    """Mean and interval of the first n seeds over n, for each setting."""
    from matplotlib.figure import Figure

    known = [one for one in settings if len(one.found) > 2]
    if not known:
        return None
    figure = Figure(figsize=(4.6, 3.2), layout="constrained")
    axes = figure.subplots()
    for one in known:
        n, mean, low, high = np.array(by_number_of_seeds(one.found)).T
        (line,) = axes.plot(n, mean, label=name_of(one.values))
        axes.fill_between(n, low, high, color=line.get_color(), alpha=0.15, linewidth=0.0)
    axes.set_xlabel("number of seeds")
    axes.set_ylabel(f"mean of {quantity}, 95 %")
    axes.legend()
    return figure


@styled
def bands(found: Sequence[Found], quantity: str) -> Any:
    """Bands of all seeds over each other, one panel a setting: where do slopes fail, and do the weak ones fail elsewhere?"""
    import matplotlib
    from matplotlib.figure import Figure

    groups: dict[str, list[tuple[float, np.ndarray]]] = {}
    ground = None
    for one in found:
        value = one.told["values"].get(quantity)
        if value is None:
            continue
        with contextlib.suppress(OSError, LookupError, exits.RunEnded), open_run(one.folder) as run:
            line = _band(run)
            if line is not None:
                groups.setdefault(name_of(one.point.values), []).append((value[0], line))
                ground = ground or (run.gridpoints(0).xy, run.zones(0).corners)
    if not groups or ground is None:
        return None
    shown = dict(list(groups.items())[:MOST_MAPS])
    columns = min(3, len(shown))
    rows = -(-len(shown) // columns)
    figure = Figure(figsize=(2.4 * columns + 0.6, 1.8 * rows), layout="constrained")
    panels = np.atleast_1d(figure.subplots(rows, columns, squeeze=False)).ravel()
    values = [value for group in shown.values() for value, _ in group]
    scale = matplotlib.colors.Normalize(min(values), max(values) if max(values) > min(values) else min(values) + 1.0)
    colours = matplotlib.cm.ScalarMappable(scale, matplotlib.colormaps["viridis"])
    for axes, (name, group) in zip(panels, shown.items(), strict=False):
        domain.outline(axes, *ground)
        for value, line in sorted(group, key=lambda pair: -pair[0]):
            axes.plot(*line.T, color=colours.cmap(scale(value)), linewidth=1.2)
        domain.finish(axes, f"{name}: {len(group)} bands")
    for axes in panels[len(shown) :]:
        axes.set_visible(False)
    figure.colorbar(colours, ax=list(panels), label=quantity)
    return figure


def _band(run: Run) -> np.ndarray | None:
    """Line of the band in the last frame under overload; None without one."""
    levels = failure.levels(run)
    if not levels or levels[-1].through <= 0.0:
        return None
    cells, last = failure.cells(run, levels[-1].frame), levels[-1]
    surface: shear_band.Surface = failure.ground(run)
    return band_line.line_of_band(cells, surface, last.through)


def _by_other_keys(settings: Sequence[Setting]) -> dict[str, list[Setting]]:
    """Settings by the values of all keys but the first."""
    groups: dict[str, list[Setting]] = {}
    for one in settings:
        groups.setdefault(name_of(dict(list(one.values.items())[1:])), []).append(one)
    return groups


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
