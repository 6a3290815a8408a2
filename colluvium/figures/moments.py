"""Moments for figures of the shear band: its states if it has reached more than the first, else even steps."""

from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

from colluvium.figures import frames, style
from colluvium.results import band_states
from colluvium.results.run import Run

PANELS = 4


class Moment(NamedTuple):
    """A frame, and the state of the band in it or ""."""

    words: str
    frame: int


def lacking(run: Run) -> str:
    """Text of the data that a run lacks for the states of the band; "" if it has all."""
    if not run.windows or not run.recorded(0):
        return "no continuum with a window of discs"
    return "" if run.stages_where(overloads=True) else "no frame of an overload stage"


def of_band(run: Run) -> list[Moment]:
    """The last frame before the band enters the window, then each frame in which one or more states are reached."""
    found = _reaches(run)
    before = band_states.last_before(found)
    shown = [Moment("a, last frame", before.frame)] if before else []
    for one in band_states.states(found)[1:]:
        if one.reach and one.reach.frame not in [moment.frame for moment in shown]:
            letters = "".join(sorted(one.letter + one.alike))
            shown.append(Moment("\n".join(f"{letter} {band_states.MEANING[letter]}" for letter in letters), one.reach.frame))
    return shown


def of_run(run: Run, rank: int, otherwise: Callable[[Run, int, int], list[int]] = frames.of_last_stage) -> list[Moment]:
    """The initial coupled state, `of_band` and the last frame if the band enters the window; else PANELS of `otherwise`."""
    if not lacking(run):
        reached = of_band(run)
        first = _reaches(run)[0].frame
        if len(reached) > 1:
            start = [Moment(f"a {band_states.MEANING['a']}", first)] if first != reached[0].frame else []
            shown = [moment for moment in start + reached if run.has(moment.frame, rank)]
            end = frames.last(run, rank)
            return shown if end in [moment.frame for moment in shown] else [*shown, Moment("last frame", end)]
    return [Moment("", frame) for frame in otherwise(run, rank, PANELS)]


def title(run: Run, moment: Moment) -> str:
    """Text of the state, and below it the time of the frame."""
    when = style.moment(run.frames[moment.frame])
    return f"{moment.words}\n{when}" if moment.words else when


@lru_cache(maxsize=1)
def _reaches(run: Run) -> list[band_states.Reach]:
    """`band_states.reaches` of a run, computed once for all figures because it reads all frames."""
    return band_states.reaches(run)
