"""End of a stage: the first of its conditions that is fulfilled, but never inside a ramp or a hand-over."""

from collections.abc import Sequence
from typing import Any

SUSTAINED = 5  # checks in a row at which all ratios must be below the limit


class Ending:
    """Conditions of one stage (`until` of the scene); `not_before` is the number of steps of its ramps."""

    def __init__(self, until: Any, not_before: int) -> None:
        self.until, self.not_before = until, not_before
        self._below = 0

    def out_of_steps(self, steps: int) -> str:
        """Reason to end if `steps` are all steps of the stage, or ""."""
        return f"{steps} steps" if self.until.steps is not None and steps >= self.until.steps else ""

    def out_of_time(self, time: float, dt: float) -> str:
        """Reason to end if `time` [s] is the time of the stage, to half a step `dt` [s], or ""."""
        return f"{time:.6g} s" if self.until.time is not None and time >= self.until.time - 0.5 * dt else ""

    def reached(self, steps: int, ratios: Sequence[float], displacement: float) -> str:
        """Reason to end after `steps` steps, or "". ratios: of every code; displacement: largest of a gridpoint [m]."""
        u = self.until
        self._below = self._below + 1 if u.ratio is not None and max(ratios) <= u.ratio else 0
        if u.displacement is not None and displacement >= u.displacement:
            return f"displacement {displacement:.3g} m"
        if self._below >= SUSTAINED and steps >= self.not_before:
            return f"ratio {max(ratios):.2g}"
        return ""
