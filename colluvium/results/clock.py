"""Time of a run: parts of consecutive stages that all compute in real time, or all in static mode with steps of 1."""

from typing import NamedTuple

import numpy as np

from colluvium.results.run import Run
from coupler_protocol.scene.tables.stages import time_axis


class Part(NamedTuple):
    """Consecutive stages of one mode, between two steps of the run."""

    real: bool
    first: int  # step before their first
    last: int
    starts: tuple[tuple[int, str], ...]  # step before its first, and name, of each stage


def parts(run: Run) -> list[Part]:
    """Parts of the run, in order; a stage without steps belongs to the part that follows."""
    found: list[Part] = []
    end = 0
    waiting: list[tuple[int, str]] = []
    for stage in run.stages:
        start, end = end, max(end, run.frames[run.last_frame(stage)].step)
        if end == start:
            waiting.append((start, stage))
            continue
        starts = (*waiting, (start, stage))
        waiting = []
        mode = bool(run.in_real_time(stage))
        if found and found[-1].real == mode:
            found[-1] = found[-1]._replace(last=end, starts=found[-1].starts + starts)
        else:
            found.append(Part(mode, start, end, starts))
    return found or [Part(False, 0, max(end, 1), tuple(waiting))]


def places(run: Run, part: Part, steps: np.ndarray) -> np.ndarray:
    """Place of steps (n,) of a part on its axis: seconds since the part began in real time, otherwise the steps."""
    if not part.real:
        return np.asarray(steps, dtype=float)
    known = {info.step: info.time for info in run.frames}
    for rank in run.files:
        if run.has_history("time", rank):
            known |= dict(zip(*(column.tolist() for column in run.history("time", rank)), strict=True))
    at = np.array(sorted(known))
    times = np.interp(np.append(part.first, steps), at, [known[step] for step in at.tolist()])
    return times[1:] - times[0] if part.first > 0 else times[1:]


def axis(run: Run) -> str:
    """What ParaView takes for the time of a frame of this run: "time" [s] or "step"."""
    tables = run.scene.get("stage", ())
    return time_axis((table.get("kind", table["name"]), table.get("time", "")) for table in tables)


def label(part: Part) -> str:
    """Label of the axis of a part."""
    if not part.real:
        return "step [-]"
    return f"time since step {part.first:,} [s]" if part.first > 0 else "time [s]"
