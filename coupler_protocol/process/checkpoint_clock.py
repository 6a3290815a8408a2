"""When the next checkpoint inside of a stage is due: by wall time, by steps, or because the run is asked to stop.

A checkpoint costs at most a hundredth of the time: with `cost` the seconds from the beginning of the last one to the next step of
all sides, the interval is never shorter than SHARE times `cost`. Between two checkpoints lies at least one other step (APART), so
that all sides have completed the first before one begins the second (coupler_protocol/files/saved_moments.py).
"""

import time
from collections.abc import Callable

SHARE = 100.0
APART = 2  # steps


class CheckpointClock:
    """Clock of one run. seconds: interval by wall time, 0: none; steps: interval by steps, None: none."""

    def __init__(self, seconds: float, steps: int | None, now: Callable[[], float] = time.monotonic) -> None:
        self.seconds, self.steps, self._now = seconds, steps, now
        self.cost = 0.0  # [s] of the last checkpoint
        self._begun: float | None = None  # when the last one began, until its cost is known
        self._last, self._last_step = now(), -APART

    @property
    def interval(self) -> float:
        """Interval [s] by wall time that keeps to the share; infinite without one."""
        return max(self.seconds, SHARE * self.cost) if self.seconds > 0.0 else float("inf")

    def due(self, step: int, stop: bool = False) -> bool:
        """Whether a checkpoint is due after the step with this number of the run; stop: one is wanted as soon as possible."""
        now = self._now()
        if self._begun is not None:
            self.cost, self._begun = now - self._begun, None
        since = step - self._last_step
        if since < APART:
            return False
        return stop or now - self._last >= self.interval or (self.steps is not None and since >= self.steps)

    def steps_before(self, step: int) -> float:
        """Number of steps from this one on before the one at whose end a checkpoint is due by its number."""
        return float("inf") if self.steps is None else max(0, self._last_step + self.steps - step)

    def begins(self, step: int) -> None:
        """Notes that a checkpoint after this step begins."""
        self._begun = self._last = self._now()
        self._last_step = step
