"""Rose diagrams: how many contacts point in each direction, and how much force they carry.

In bins of 10 degrees, with the fitted curves (L. Rothenburg, R.J. Bathurst, Geotechnique 39 (1989) 601-614)

    E(theta) = (1 + a cos 2(theta - theta_a)) / 2 pi                             (1)
    f(theta) = f0 (1 + a_n cos 2(theta - theta_n))                               (2)
"""

from typing import Any, NamedTuple

import numpy as np

from colluvium.fabric import Fabric, fit_fabric
from colluvium.figures import frames, shear, style
from colluvium.results import Run

BINS = 18  # over half a turn: a contact points both ways
FEWEST = 3 * BINS
NORMALS, FORCES, CURVE = "#9fb4c7", "#d9b99b", "#1a1a1a"


class Rose(NamedTuple):
    """Directions of a frame's contacts in bins; the second half turn repeats the first."""

    fabric: Fabric
    middles: np.ndarray  # (2 BINS,) directions of the bins [rad]
    density: np.ndarray  # (2 BINS,) share of the contacts per radian [1/rad]
    force: np.ndarray  # (2 BINS,) mean normal force of the contacts in each bin [N], 0 where there are none


def applies(run: Run) -> bool:
    """There are enough contacts under pressure."""
    return bool(run.windows) and bool(moments(run))


def moments(run: Run) -> list[int]:
    """The end of `couple`, which is the initial coupled state, and the frames that show the shear strain."""
    rank = run.windows[0]
    coupled = [run.last_frame("couple")] if "couple" in run.stages else []
    later = frames.of_last_stage(run, 0 if run.recorded(0) else rank, shear.PANELS)
    shown = sorted({i for i in coupled + later if run.has(i, rank)})
    return [i for i in shown if len(directions(run, i, rank)[1]) >= FEWEST]


def rose(run: Run, frame: int, rank: int = 1) -> Rose:
    """Bins and fit of the contacts that `run.fabric` counts."""
    return bin_directions(*directions(run, frame, rank))


def directions(run: Run, frame: int, rank: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Angles (C,) [rad] and normal forces (C,) [N] of the compressed contacts that are neither on the ring nor in one stone."""
    discs, contacts = run.discs(frame, rank), run.contacts(frame, rank)
    ends, force = contacts.ends, contacts.normal_force
    used = force > 0.0
    if "control" in discs:
        used &= ~(discs.control[ends] == 1).any(axis=1)
    if "stone" in discs:
        first, second = discs.stone[ends].T
        used &= (first != second) | (first < 0)
    branch = np.diff(discs.xy[ends[used]], axis=1)[:, 0]
    return np.arctan2(branch[:, 1], branch[:, 0]), force[used]


def bin_directions(theta: np.ndarray, force: np.ndarray) -> Rose:
    """Normals at angles theta (C,) [rad] with normal forces (C,) [N]."""
    width = np.pi / BINS
    place = np.floor(theta % np.pi / width).astype(int) % BINS
    number = np.bincount(place, minlength=BINS)
    mean = np.bincount(place, force, BINS) / np.maximum(number, 1)
    density = number / len(theta) / (2.0 * width)
    return Rose(fit_fabric(theta, force), (np.arange(2 * BINS) + 0.5) * width, np.tile(density, 2), np.tile(mean, 2))


@style.styled
def draw(run: Run) -> Any:
    """The first window. Rows: normals, forces. Columns: moments; each row has one scale."""
    import matplotlib.pyplot as plt

    rank, shown = run.windows[0], moments(run)
    roses = [rose(run, frame, rank) for frame in shown]
    figure, axes = plt.subplots(
        2,
        len(shown),
        figsize=(0.8 + 2.6 * len(shown), 6.6),
        subplot_kw={"projection": "polar"},
        squeeze=False,
        layout="constrained",
    )
    around = np.linspace(0.0, 2.0 * np.pi, 361)
    for (above, below), frame, one in zip(axes.T, shown, roses, strict=True):
        f = one.fabric
        density = (1.0 + f.a * np.cos(2.0 * (around - np.radians(f.theta_a)))) / (2.0 * np.pi)  # Eq. 1
        force = 1.0 + f.a_n * np.cos(2.0 * (around - np.radians(f.theta_n)))  # Eq. 2
        _panel(above, one.middles, one.density, around, density, NORMALS)
        _panel(below, one.middles, one.force / f.f0, around, force, FORCES)
        factor, unit = style.readable("N", np.array([f.f0]))
        low, high = f.a_interval
        above.set_title(
            f"{style.moment(run.frames[frame])}\n{f.contacts:,} contacts\n"
            f"a = {f.a:.3f} (95 %: {low:.3f} to {high:.3f})\n$\\theta_a$ = {f.theta_a:.0f}°"
        )
        below.set_title(f"a$_n$ = {f.a_n:.3f}, f$_0$ = {factor * f.f0:.3g} {unit}\n$\\theta_n$ = {f.theta_n:.0f}°")
    for row, words in zip(axes, ("contact normals: density [1/rad]", "mean normal force over f$_0$ [-]"), strict=True):
        top = max(place.get_ylim()[1] for place in row)
        for place in row:
            place.set_ylim(0.0, top)
        row[0].annotate(words, (-0.22, 0.5), xycoords="axes fraction", rotation=90.0, va="center", ha="center")
    return figure


def _panel(axes: Any, middles: np.ndarray, bars: np.ndarray, around: np.ndarray, curve: np.ndarray, colour: str) -> None:
    axes.bar(middles, bars, width=np.pi / BINS, color=colour, edgecolor="white", linewidth=0.3)
    axes.plot(around, curve, color=CURVE, linewidth=1.0)
    axes.set_thetagrids(range(0, 360, 90), [f"{angle}°" for angle in range(0, 360, 90)], fontsize=7.0)
    axes.yaxis.set_major_locator(_few_ticks())
    axes.tick_params(axis="x", pad=-2.0)
    axes.tick_params(axis="y", labelsize=6.5)
    axes.set_axisbelow(False)
    axes.set_rlabel_position(22.5)
    axes.grid(color=style.PALE, linewidth=0.3)
    axes.spines["polar"].set_visible(False)


def _few_ticks() -> Any:
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(3)
