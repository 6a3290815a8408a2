"""Wall time of a process: seconds of every stage, and a trace of its first steps with one row for each interval.

A process computes, waits for the other side, or records. `NAME.trace.csv` in the run directory has the columns

    stage     name of the stage
    step      steps of the stage that were done when the interval ended
    activity  computing, waiting or recording
    begin, end  [s] of time.perf_counter

Intervals follow one another without gaps within a step. On Linux and macOS perf_counter counts from the machine's start for all
processes, so files of one machine have the same time axis; files of two machines do not.
"""

import csv
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

COLUMNS = ("stage", "step", "activity", "begin", "end")


@dataclass
class StageTimes:
    """Seconds of one stage on one side; `steps`: of the stage.

    plain_steps: steps of the discs in compiled calls of many; one_by_one: why there were none.
    """

    name: str
    steps: int = 0
    computing: float = 0.0
    waiting: float = 0.0
    recording: float = 0.0
    plain_steps: int = 0
    one_by_one: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Plain data for run.json."""
        return asdict(self)


class Stopwatch:
    """Adds the time since the last call to one of a stage's columns."""

    def __init__(self) -> None:
        self.stages: list[StageTimes] = []
        self._last = time.perf_counter()

    def begin(self, name: str) -> None:
        """Starts a stage."""
        self.stages.append(StageTimes(name))
        self._last = time.perf_counter()

    def add_to(self, column: str) -> None:
        """Books the time since the last booking under `column` of the present stage."""
        now = time.perf_counter()
        stage = self.stages[-1]
        setattr(stage, column, getattr(stage, column) + now - self._last)
        self._last = now

    def add_plain_steps(self, steps: int, seconds: float, marks: Any) -> None:
        """Books the time since the last booking, of plain steps: `seconds` of it under waiting, the rest under computing.

        steps: number of them that were completed; marks (n,2): times [ns] between which each step waited, for a trace.
        """
        now = time.perf_counter()
        stage = self.stages[-1]
        stage.waiting += seconds
        stage.computing += now - self._last - seconds
        self._last = now


class Trace(Stopwatch):
    """A Stopwatch that stores its intervals in the first `steps` steps of every stage."""

    def __init__(self, steps: int) -> None:
        super().__init__()
        self.steps = steps
        self.rows: list[tuple[Any, ...]] = []
        self._done = 0  # steps of the stage that were done when the present one began

    def begin(self, name: str) -> None:
        """Starts a stage."""
        super().begin(name)
        self._done = 0

    def add_to(self, column: str) -> None:
        """Books the time since the last booking, and stores the interval. A step ends with its booking under recording."""
        begin = self._last
        super().add_to(column)
        stage = self.stages[-1]
        if self._done < self.steps:
            self.rows.append((stage.name, stage.steps, column, begin, self._last))
        if column == "recording":
            self._done = stage.steps

    def add_plain_steps(self, steps: int, seconds: float, marks: Any) -> None:
        """Books the time of plain steps, and stores the intervals of those that belong to the trace."""
        stage, begin = self.stages[-1], self._last
        super().add_plain_steps(steps, seconds, marks)
        for step, (first, last) in enumerate(1e-9 * marks[: steps + 1]):
            if stage.steps + step < self.steps and begin < first:  # else the step did not wait in this call
                self.rows.append((stage.name, stage.steps + step, "computing", begin, first))
                self.rows.append((stage.name, stage.steps + step, "waiting", first, last))
                begin = last
        if stage.steps + steps < self.steps:
            self.rows.append((stage.name, stage.steps + steps, "computing", begin, self._last))
        self._done = stage.steps + steps

    def write(self, path: str | Path) -> None:
        """Writes the file."""
        with open(path, "w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(COLUMNS)
            writer.writerows((*row[:3], *(f"{moment:.9f}" for moment in row[3:])) for row in self.rows)


def stopwatch(steps: int | None) -> Stopwatch:
    """A Stopwatch, or with `steps` (None: no trace) a Trace."""
    return Stopwatch() if steps is None else Trace(steps)
