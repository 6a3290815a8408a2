"""Moments of a run at which its sides are saved, as the sides tell each other."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple


class Moment(NamedTuple):
    """A moment: session in which both sides computed it, number of the stage, step since the run began (0: end of the stage)."""

    session: int
    stage: int
    step: int

    @property
    def order(self) -> tuple[int, float]:
        """Later moments have a larger one."""
        return self.stage, self.step or float("inf")

    def as_text(self, scene: Any) -> str:
        """Text for messages."""
        name = scene.name_of_stage(self.stage) if 0 <= self.stage < len(scene.stage) else self.stage
        return f"step {self.step} of stage {name!r}" if self.step else f"the end of stage {name!r}"


def as_texts(moments: Iterable[Moment], scene: Any) -> str:
    """Text with some moments, or that there is none."""
    found = [moment.as_text(scene) for moment in moments]
    return " and ".join(filter(None, [", ".join(found[:-1]), found[-1]])) if found else "no moment"


def newest_common(own: Iterable[Moment], theirs: Sequence[Iterable[Moment]], needs: Callable[[Moment], bool]) -> Moment | None:
    """The newest of the moments `own` that each of the other sides has; needs(moment): whether they have to."""
    others = [set(one) for one in theirs]
    usable = (moment for moment in own if not needs(moment) or all(moment in other for other in others))
    return max(usable, key=lambda moment: moment.order, default=None)
