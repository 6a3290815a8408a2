"""Histories over the steps: unbalanced force ratio of both sides, gravity factor, broken bonds."""

from typing import Any

from colluvium.figures import style
from colluvium.results.run import Run

ROWS = (  # histories with a row each if any rank has them; logarithmic or not
    ("unbalanced_ratio", "unbalanced force ratio", True),
    ("gravity_factor", "gravity factor", False),
    ("bonds_broken", "bonds broken", False),
    ("max_displacement", "largest displacement", True),
)
NAME_ROOM = 0.025  # part of the axis for the name of a stage
COLOURS = ("#123a5e", "#d0472f", "#5c8a3a", "#8a5c9e")


def missing(run: Run) -> str:
    """Text of the missing data: any of these histories. "" if there is one."""
    return "" if _rows(run) else "no history was recorded"


@style.styled
def draw(run: Run) -> Any:
    """Draws one row for each history, one line for each rank, with marked stages."""
    import matplotlib.pyplot as plt

    rows = _rows(run)
    figure, axes = plt.subplots(
        len(rows), 1, figsize=(style.PAGE, 0.6 + 1.6 * len(rows)), sharex=True, squeeze=False, layout="constrained"
    )
    for place, (name, words, logarithmic) in zip(axes[:, 0], rows, strict=True):
        for rank, file in run.files.items():
            if run.has_history(name, rank):
                label = f"{file.kind}, rank {rank}"
                colour = COLOURS[rank % len(COLOURS)]
                place.plot(*run.history(name, rank), color=colour, label=label, linewidth=1.0)
        place.set_ylabel(f"{words} [{run.units(name)}]")
        if logarithmic:
            place.set_yscale("log")
        place.grid(color=style.PALE, linewidth=0.3)
        _mark_stages(run, place)
    _name_stages(run, axes[0, 0])
    axes[0, 0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.02), ncols=len(run.files), borderaxespad=0.0)
    axes[-1, 0].set_xlabel("step [-]")
    return figure


def _rows(run: Run) -> list[tuple[str, str, bool]]:
    return [row for row in ROWS if any(run.has_history(row[0], rank) for rank in run.files)]


def _stage_starts(run: Run) -> list[tuple[int, str]]:
    """First step of each stage; stages that begin too close to each other to be named apart share a name."""
    starts: list[tuple[int, str]] = []
    end = 0
    for stage in run.stages:
        if starts and end - starts[-1][0] < NAME_ROOM * run.frames[-1].step:
            starts[-1] = (starts[-1][0], f"{starts[-1][1]}, {stage}")
        else:
            starts.append((end, stage))
        end = run.frames[run.last_frame(stage)].step
    return starts


def _mark_stages(run: Run, axes: Any) -> None:
    for step, _ in _stage_starts(run):
        axes.axvline(step, color=style.PALE, linewidth=0.8, zorder=0)


def _name_stages(run: Run, axes: Any) -> None:
    for step, stage in _stage_starts(run):
        axes.annotate(stage, (step, 1.02), xycoords=("data", "axes fraction"), va="bottom", rotation=25.0)
