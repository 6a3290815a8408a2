"""End of a stage: the first of its conditions that is fulfilled, but never inside a ramp or a hand-over."""

from collections.abc import Sequence
from typing import Any

SUSTAINED = 5  # checks in a row at which all ratios must be below the limit


def least_steps(stage: Any) -> int:
    """Steps that a stage takes at least: all of them if nothing else can end it, those of its ramp if rest can, else 0."""
    until = stage.until
    if until is None or any(end is not None for end in (until.time, until.displacement, until.band)):
        return 0
    if until.ratio is None:
        return until.steps or 0
    ramp = 0 if stage.gravity_factor is None else stage.gravity_factor.over
    return min(until.steps or ramp, ramp)


class Ending:
    """Conditions of one stage (`until` of the scene); `not_before` is the number of steps of its ramps."""

    def __init__(self, until: Any, not_before: int) -> None:
        self.until, self.not_before = until, not_before
        self._below = 0
        self.at_limit = False  # whether steps or time were used up

    def saved(self) -> dict[str, Any]:
        """What changes, for a checkpoint inside of the stage."""
        return {"below": self._below, "at_limit": self.at_limit}

    def restore(self, saved: dict[str, Any]) -> None:
        """Sets what `saved` gave."""
        self._below, self.at_limit = saved["below"], saved["at_limit"]

    def out_of_steps(self, steps: int) -> str:
        """Reason to end if `steps` are all steps of the stage, or ""."""
        return self._limit(f"{steps} steps", self.until.steps is not None and steps >= self.until.steps)

    def out_of_time(self, time: float, dt: float) -> str:
        """Reason to end if `time` [s] is the time of the stage, to half a step `dt` [s], or ""."""
        return self._limit(f"{time:.6g} s", self.until.time is not None and time >= self.until.time - 0.5 * dt)

    def _limit(self, reason: str, used_up: bool) -> str:
        self.at_limit = self.at_limit or used_up
        return reason if used_up else ""

    def reached(self, steps: int, ratios: Sequence[float], displacement: float, waiting: bool = False) -> str:
        """Reason to end after `steps` steps, or "". ratios: of every code; displacement: largest of a gridpoint [m].

        waiting: whether a load is incomplete because it waits for rest.
        """
        u = self.until
        self._below = self._below + 1 if u.ratio is not None and max(ratios) <= u.ratio and not waiting else 0
        if u.displacement is not None and displacement >= u.displacement:
            return f"displacement {displacement:.3g} m"
        if self._below >= SUSTAINED and steps >= self.not_before:
            return f"ratio {max(ratios):.2g}"
        return ""
