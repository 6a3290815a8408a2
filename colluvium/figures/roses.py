"""Rose diagrams: number and force of contacts by direction.

In bins of 10 degrees, with the fitted curves (L. Rothenburg, R.J. Bathurst, Geotechnique 39 (1989) 601-614)

    E(theta) = (1 + a cos 2(theta - theta_a)) / 2 pi                             (1)
    f(theta) = f0 (1 + a_n cos 2(theta - theta_n))                               (2)
"""

from typing import Any, NamedTuple

import numpy as np

from colluvium.figures import moments, style
from colluvium.results import fabric
from colluvium.results.fabric import Fabric, fit_fabric
from colluvium.results.run import Run

BINS = 18  # over half a turn: the direction of a contact has no sign
FEWEST = 3 * BINS
COLUMNS = 4  # roses in a row
NORMALS, FORCES, CURVE = "#9fb4c7", "#d9b99b", "#1a1a1a"


class Rose(NamedTuple):
    """Directions of a frame's contacts in bins; the second half turn repeats the first."""

    fabric: Fabric
    middles: np.ndarray  # (2 BINS,) directions of the bins [rad]
    density: np.ndarray  # (2 BINS,) share of the contacts per radian [1/rad]
    force: np.ndarray  # (2 BINS,) mean normal force of the contacts in each bin [N], 0 without contacts


def missing(run: Run, rank: int | None = None) -> str:
    """Text of the missing data: enough contacts under pressure. "" if there are enough."""
    if not run.windows:
        return "no frame of discs"
    return "" if shown(run, rank) else f"fewer than {FEWEST} contacts under pressure"


def shown(run: Run, rank: int | None = None) -> list[moments.Moment]:
    """The end of the couple stage, which is the initial coupled state, and the moments of the band, if contacts are enough.

    rank: of a window; None: the first.
    """
    rank = run.windows[0] if rank is None else rank
    found = moments.of_run(run, rank)
    coupling = run.stages_where(couples=True)
    start = run.last_frame(coupling[0]) if coupling else found[0].frame
    if start < found[0].frame and run.has(start, rank):
        found = [moments.Moment("", start), *found]
    return [one for one in found if len(directions(run, one.frame, rank)[1]) >= FEWEST]


def rose(run: Run, frame: int, rank: int = 1) -> Rose:
    """Bins and fit of the contacts that `run.fabric` counts."""
    return bin_directions(*directions(run, frame, rank))


def directions(run: Run, frame: int, rank: int = 1) -> fabric.Directions:
    """The contacts that `run.fabric` counts."""
    return fabric.directions(run.discs(frame, rank), run.contacts(frame, rank))


def bin_directions(theta: np.ndarray, force: np.ndarray, bodies: np.ndarray | None = None) -> Rose:
    """Rose of contacts with normals at angles theta (C,) [rad] and normal forces (C,) [N]; bodies: of `fit_fabric`."""
    width = np.pi / BINS
    place = np.floor(theta % np.pi / width).astype(int) % BINS
    number = np.bincount(place, minlength=BINS)
    mean = np.bincount(place, force, BINS) / np.maximum(number, 1)
    density = number / len(theta) / (2.0 * width)
    return Rose(fit_fabric(theta, force, bodies), (np.arange(2 * BINS) + 0.5) * width, np.tile(density, 2), np.tile(mean, 2))


@style.styled
def draw(run: Run, rank: int | None = None) -> Any:
    """Draws roses of a window (none: the first). Rows: normals, forces. Columns: moments; each row has one scale."""
    import matplotlib.pyplot as plt

    rank = run.windows[0] if rank is None else rank
    found = shown(run, rank)
    roses = [rose(run, moment.frame, rank) for moment in found]
    columns = min(len(found), COLUMNS)
    blocks = -(-len(found) // columns)
    figure, grid = plt.subplots(
        2 * blocks,
        columns,
        figsize=(style.PAGE, 0.2 + 2.0 * (0.8 * style.PAGE / max(columns, 3) + 0.8) * blocks),
        subplot_kw={"projection": "polar"},
        squeeze=False,
        layout="constrained",
    )
    around = np.linspace(0.0, 2.0 * np.pi, 361)
    axes = np.concatenate([grid[2 * block : 2 * block + 2] for block in range(blocks)], axis=1)  # normals over forces
    for place in axes[:, len(found) :].flat:
        place.set_axis_off()
    for (above, below), moment, one in zip(axes.T, found, roses, strict=False):
        f = one.fabric
        density = (1.0 + f.a * np.cos(2.0 * (around - np.radians(f.theta_a)))) / (2.0 * np.pi)  # Eq. 1
        force = 1.0 + f.a_n * np.cos(2.0 * (around - np.radians(f.theta_n)))  # Eq. 2
        _panel(above, one.middles, one.density, around, density, NORMALS)
        _panel(below, one.middles, one.force / f.f0, around, force, FORCES)
        factor, unit = style.readable("N", np.array([f.f0]))
        above.set_title(
            f"{moments.title(run, moment)}\n{f.contacts:,} contacts\n"
            f"a = {f.a:.3f}, 95 %:\n{_range(f.a_interval)}\n{_direction('a', f.theta_a, f.theta_a_error, f.contacts_isotropic)}"
        )
        below.set_title(
            f"f$_0$ = {factor * f.f0:.3g} {unit}\na$_n$ = {f.a_n:.3f}, 95 %:\n{_range(f.a_n_interval)}\n"
            f"{_direction('n', f.theta_n, f.theta_n_error, f.forces_isotropic)}"
        )
    for row, words in zip(axes, ("contact normals: density [1/rad]", "mean normal force over f$_0$ [-]"), strict=True):
        top = max(place.get_ylim()[1] for place in row[: len(found)])
        for place in row:
            place.set_ylim(0.0, top)
        for place in row[::columns]:
            place.annotate(words, (-0.22, 0.5), xycoords="axes fraction", rotation=90.0, va="center", ha="center")
    return figure


def _range(interval: tuple[float, float]) -> str:
    return f"{interval[0]:.3f} to {interval[1]:.3f}"


def _direction(index: str, angle: float, error: float, isotropic: bool) -> str:
    """Text of a direction with its error, or that there is none."""
    return "isotropic within 95 %" if isotropic else f"$\\theta_{index}$ = {angle:.0f} ± {error:.0f}°"


def _panel(axes: Any, middles: np.ndarray, bars: np.ndarray, around: np.ndarray, curve: np.ndarray, colour: str) -> None:
    axes.bar(middles, bars, width=np.pi / BINS, color=colour, edgecolor="white", linewidth=0.3)
    axes.plot(around, curve, color=CURVE, linewidth=1.0)
    axes.set_thetagrids(range(0, 360, 90), [f"{angle}°" for angle in range(0, 360, 90)], fontsize=7.0)
    axes.yaxis.set_major_locator(_few_ticks())
    axes.tick_params(axis="x", pad=-2.0)
    axes.tick_params(axis="y", labelsize=7.0)
    axes.set_axisbelow(False)
    axes.set_rlabel_position(22.5)
    axes.grid(color=style.PALE, linewidth=0.3)
    axes.spines["polar"].set_visible(False)


def _few_ticks() -> Any:
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(3)
