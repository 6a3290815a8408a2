"""What a process did when: computing, waiting and recording in the first steps of every stage, one row an interval.

`NAME.trace.csv` in the run directory has the columns

    stage     name of the stage
    step      steps of the stage that were done when the interval ended
    activity  computing, waiting or recording
    begin, end  [s] of time.perf_counter

Intervals follow one another without gaps within a step. Linux and macOS count perf_counter from the machine's start for all
processes, so files of processes of one machine have one time; of two machines they do not.
"""

import csv

from coupler_protocol.timing import Stopwatch

COLUMNS = ("stage", "step", "activity", "begin", "end")


class Trace(Stopwatch):
    """A Stopwatch that keeps the intervals it books in the first `steps` steps of every stage."""

    def __init__(self, steps):
        super().__init__()
        self.steps, self.rows = steps, []
        self._done = 0  # steps of the stage that were done when the present one began

    def begin(self, name):
        """Start a stage."""
        super().begin(name)
        self._done = 0

    def to(self, column):
        """Book the time since the last booking, and keep when that was. With its recording a step is over."""
        begin = self._last
        super().to(column)
        stage = self.stages[-1]
        if self._done < self.steps:
            self.rows.append((stage.name, stage.steps, column, begin, self._last))
        if column == "recording":
            self._done = stage.steps

    def write(self, path):
        """Write the file."""
        with open(path, "w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(COLUMNS)
            writer.writerows((*row[:3], *(f"{time:.9f}" for time in row[3:])) for row in self.rows)


def stopwatch(steps):
    """A Stopwatch; with `steps` (None: no trace) one that keeps intervals."""
    return Stopwatch() if steps is None else Trace(steps)
