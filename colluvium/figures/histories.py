"""Histories: everything that was recorded and changes, over time in real time and over steps in static mode.

Bands are standard errors of the measures of regions.
"""

from typing import Any, NamedTuple

import numpy as np

from colluvium.figures import style
from colluvium.results import clock
from colluvium.results.run import Run
from coupler_protocol.files.quantities import PER_STEP

ROWS = (  # names of histories up to a colon, or beginnings that end in *; logarithmic or not
    ("unbalanced_ratio", "unbalanced force ratio", True),
    ("gravity_factor", "gravity factor", False),
    ("bonds_broken", "bonds broken", False),
    ("max_displacement", "largest displacement", True),
    ("stress_xx", "stress xx of regions", False),
    ("stress_yy", "stress yy of regions", False),
    ("stress_xy", "stress xy of regions", False),
    ("porosity", "porosity of regions", False),
    ("coordination", "contacts a body in regions", False),
    ("sliding", "sliding contacts in regions", False),
    ("strain_rate_xx", "strain rate xx of regions", False),
    ("strain_rate_yy", "strain rate yy of regions", False),
    ("strain_rate_xy", "strain rate xy of regions", False),
    ("wall_pressure", "pressure on walls", False),
    ("wall_force_x", "force on walls, x", False),
    ("wall_force_y", "force on walls, y", False),
    ("reaction_x", "reactions, x", False),
    ("reaction_y", "reactions, y", False),
    ("moved_x", "moved boundaries, x", False),
    ("moved_y", "moved boundaries, y", False),
    ("kinetic_energy", "kinetic energy", True),
    ("energy_*", "energies", False),
    ("velocity_caps", "capped velocities", False),
)
NAME_ROOM = 0.05  # part of the axis for the name of a stage
BAND = 0.2  # opacity of the band of a standard error
NARROWEST = 0.25  # width of a part of the run over that of the widest
COLOURS = ("#123a5e", "#d0472f", "#5c8a3a", "#8a5c9e", "#b08a2e", "#3a8a8a", "#7a7a7a", "#c06a9a")


class Line(NamedTuple):
    """One history of one rank; `words`: what tells it from the others of its row."""

    rank: int
    name: str
    words: str


class Row(NamedTuple):
    """Histories of one quantity, for one axes."""

    words: str
    unit: str
    logarithmic: bool
    lines: tuple[Line, ...]


def missing(run: Run) -> str:
    """Text of the missing data: any history that changes. "" if there is one."""
    return "" if recorded_rows(run) else "no history that changes was recorded"


def recorded_rows(run: Run) -> list[Row]:
    """Rows with the histories that change; a sum over parts (walls) is left out beside its parts."""
    found = []
    for wanted, words, logarithmic in ROWS:
        lines = []
        for rank, file in run.files.items():
            names = [name for name in file.history_names() if _fits(name, wanted) and _changes(run.history(name, rank)[1])]
            parts = [name for name in names if ":" in name or wanted.endswith("*")] or names
            side = f"{file.kind}, rank {rank}"
            lines += [Line(rank, name, _own_words(name, wanted) or side) for name in parts]
        if lines:
            found.append(Row(words, _unit(run, lines[0].name), logarithmic, tuple(lines)))
    return found


@style.styled
def draw(run: Run) -> Any:
    """Draws one row for each quantity; columns: parts of the run in real time over seconds, in static mode over steps."""
    import matplotlib.pyplot as plt

    shown, parts = recorded_rows(run), clock.parts(run)
    length = np.array([part.last - part.first for part in parts], dtype=float)
    figure, axes = plt.subplots(
        len(shown),
        len(parts),
        figsize=(style.PAGE, 0.9 + 1.5 * len(shown)),
        sharex="col",
        sharey="row",
        squeeze=False,
        width_ratios=np.maximum(length / length.max(), NARROWEST),
        layout="constrained",
    )
    for places, row in zip(axes, shown, strict=True):
        factor, unit = style.readable(row.unit, *(run.history(line.name, line.rank)[1] for line in row.lines))
        for place, part in zip(places, parts, strict=True):
            _draw_lines(run, part, row, place, factor)
        places[0].set_ylabel(f"{row.words}\n[{unit}]")
        places[-1].legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.2, handlelength=1.0)
    for place, part in zip(axes[0], parts, strict=True):
        name_stages(run, part, place)
    for place, part in zip(axes[-1], parts, strict=True):
        place.set_xlabel(clock.label(part))
    return figure


def _fits(name: str, wanted: str) -> bool:
    return name.startswith(wanted[:-1]) if wanted.endswith("*") else name.partition(":")[0] == wanted


def _own_words(name: str, wanted: str) -> str:
    return name[len(wanted) - 1 :] if wanted.endswith("*") else name.partition(":")[2]


def _error_of(name: str) -> str:
    """Name of the history with the standard errors of another one."""
    quantity, colon, part = name.partition(":")
    return f"{quantity}_error{colon}{part}"


def _unit(run: Run, name: str) -> str:
    """Unit of a history over all stages: a rate is per step in static ones."""
    unit = run.units(name)
    modes = {run.in_real_time(stage) for stage in run.stages} if unit in PER_STEP else set()
    return unit if False not in modes else f"{unit} or {PER_STEP[unit]}" if True in modes else PER_STEP[unit]


def _changes(values: np.ndarray) -> bool:
    known = values[np.isfinite(values)]
    return bool(len(known)) and bool((known != known[0]).any())


def _draw_lines(run: Run, part: clock.Part, row: Row, axes: Any, factor: float) -> None:
    several = len({line.rank for line in row.lines}) < len(row.lines)
    for number, line in enumerate(row.lines):
        steps, values = run.history(line.name, line.rank)
        own = (steps > part.first) & (steps <= part.last) | (steps == 0) & (part.first == 0)
        colour = COLOURS[(number if several else line.rank) % len(COLOURS)]
        axes.plot(clock.places(run, part, steps[own]), factor * values[own], color=colour, label=line.words, linewidth=1.0)
        error = _error_of(line.name)
        if run.has_history(error, line.rank):  # of the same steps
            low, high = (factor * (values + sign * run.history(error, line.rank)[1])[own] for sign in (-1.0, 1.0))
            axes.fill_between(clock.places(run, part, steps[own]), low, high, color=colour, alpha=BAND, linewidth=0.0)
    if row.logarithmic:
        axes.set_yscale("log", nonpositive="mask")  # a ratio of zero has no place there
    axes.grid(color=style.PALE, linewidth=0.3)
    for place in clock.places(run, part, np.array([step for step, _ in part.starts])):
        axes.axvline(place, color=style.PALE, linewidth=0.8, zorder=0)


def name_stages(run: Run, part: clock.Part, axes: Any) -> None:
    """Writes the names of stages above an axes; stages that begin too close to each other to be named apart share a name."""
    room = NAME_ROOM * (part.last - part.first)
    named: list[tuple[int, str]] = []
    for step, stage in part.starts:
        if named and step - named[-1][0] < room:
            named[-1] = (named[-1][0], f"{named[-1][1]}, {stage}")
        else:
            named.append((step, stage))
    for place, (_, words) in zip(clock.places(run, part, np.array([step for step, _ in named])), named, strict=True):
        axes.annotate(words, (place, 1.02), xycoords=("data", "axes fraction"), va="bottom", rotation=25.0)
