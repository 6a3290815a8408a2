"""Where the wall time of a stage goes: computing, waiting for the peer, recording."""

import time
from dataclasses import asdict, dataclass


@dataclass
class StageTimes:
    """Seconds of one stage on one side; `steps` are those of the stage."""

    name: str
    steps: int = 0
    computing: float = 0.0
    waiting: float = 0.0
    recording: float = 0.0

    def as_dict(self):
        """Plain data for run.json."""
        return asdict(self)


class Stopwatch:
    """Adds the time since the last call to one of a stage's columns."""

    def __init__(self):
        self.stages = []
        self._last = time.perf_counter()

    def begin(self, name):
        """Start a stage."""
        self.stages.append(StageTimes(name))
        self._last = time.perf_counter()

    def to(self, column):
        """Book the time since the last booking under `column` of the present stage."""
        now = time.perf_counter()
        stage = self.stages[-1]
        setattr(stage, column, getattr(stage, column) + now - self._last)
        self._last = now
