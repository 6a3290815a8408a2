"""Activities of all processes in some coupled steps: computing, waiting, recording."""

from typing import Any

import numpy as np

from colluvium.figures import style
from colluvium.results.run import Run
from colluvium.results.timeline import ACTIVITIES, Intervals, intervals

SHOWN = 12  # steps
COLOURS = dict(zip(ACTIVITIES, ("#123a5e", "#d9d9d9", "#d0472f"), strict=True))


def missing(run: Run) -> str:
    """Text of the missing data: a trace of at least two processes in coupled stages. "" if there is one."""
    found = intervals(run)
    if len(found) < 2:
        return "no trace (record.trace = STEPS writes it)"
    return "" if _coupled_stages(found) else "no coupled stage in the trace"


@style.styled
def draw(run: Run) -> Any:
    """Draws a panel for the first and the last coupled stage: the middle of the traced steps, one row for each process."""
    import matplotlib.pyplot as plt

    found = intervals(run)
    stages = _coupled_stages(found)
    stages = [stages[0], stages[-1]] if len(stages) > 1 else stages
    size = (9.0, 0.6 + len(stages) * (0.9 + 0.35 * len(found)))
    figure, panels = plt.subplots(len(stages), 1, figsize=size, squeeze=False, layout="constrained")
    for axes, stage in zip(panels[:, 0], stages, strict=True):
        _panel(axes, stage, {name: own.where(own.stage == stage) for name, own in found.items()})
    handles = [plt.Rectangle((0, 0), 1, 1, color=COLOURS[name]) for name in ACTIVITIES]
    figure.legend(handles, ACTIVITIES, loc="outside upper right", ncols=len(ACTIVITIES))
    panels[-1, 0].set_xlabel("time [ms]")
    return figure


def _coupled_stages(found: dict[str, Intervals]) -> list[str]:
    """Stages in which every process took steps, in order."""
    stepped = [set(own.stage[own.step > 0]) for own in found.values()]
    first = next(iter(found.values()))
    return [name for name in dict.fromkeys(first.stage.tolist()) if all(name in names for names in stepped)]


def _panel(axes: Any, stage: str, found: dict[str, Intervals]) -> None:
    grid = next(iter(found.values()))
    traced = int(grid.step.max())
    first = max(0, traced - SHOWN) // 2
    last = min(traced, first + SHOWN)
    start, end = _moment(grid, first), _moment(grid, last)
    inside = {name: _cut(own, start, end) for name, own in found.items()}
    for row, own in enumerate(inside.values()):
        for name in ACTIVITIES:
            spans = own.where(own.activity == name)
            pieces = np.column_stack([spans.begin - start, spans.end - spans.begin])
            axes.broken_barh((1e3 * pieces).tolist(), (row - 0.4, 0.8), color=COLOURS[name], linewidth=0.0)
    words = [f"{name} ({_percent(own)})" for name, own in inside.items()]
    axes.set_yticks(range(len(words)), words)
    axes.invert_yaxis()
    axes.set_xlim(0.0, 1e3 * (end - start))
    axes.set_title(f"{stage}, steps {first} to {last} of {traced} traced")


def _moment(own: Intervals, steps: int) -> float:
    """Time [s] at which a process had completed `steps` steps: it had recorded them, or waited for the next one (plain steps)."""
    if steps == 0:
        return float(own.begin.min())
    recorded = own.where((own.step == steps) & (own.activity == "recording"))
    if len(recorded.end):
        return float(recorded.end.min())
    waited = own.where((own.step == steps) & (own.activity == "waiting"))
    return float(waited.begin.min()) if len(waited.begin) else float(own.where(own.step <= steps).end.max())


def _cut(own: Intervals, start: float, end: float) -> Intervals:
    """Intervals between two times [s]."""
    own = own.where((own.end > start) & (own.begin < end))
    return own._replace(begin=np.maximum(own.begin, start), end=np.minimum(own.end, end))


def _percent(own: Intervals) -> str:
    shares = own.shares()
    return ", ".join(f"{100.0 * shares[name]:.0f} %" for name in ACTIVITIES)
