"""Four states of the shear band at a window of discs, by a reproducible rule, and the fabric of the contacts in each.

    a   the band has not reached the window
    b   it enters: it connects the toe with cells of the window
    c   it is through: it also connects with zones beyond the window
    d   it is complete: it also connects with the crest

A state is fulfilled in a frame if the highest shear strain that still makes its connection (`Reach`) is 1 % or more.
coupler_protocol.criteria.shear_band_states has the rule; stages can also end by it.

A state is *reached* in the first frame after which it is always fulfilled: connections through a window that shears everywhere
appear and vanish. `State.seen` is the first frame in which it is fulfilled.
"""

from typing import NamedTuple

from colluvium.results import failure
from colluvium.results.fabric import Fabric, contact_fabric
from colluvium.results.run import Run
from coupler_protocol.criteria import shear_band_states
from coupler_protocol.criteria.shear_band import COUNTED, Surface

MEANING = {
    "a": "not yet at the window",
    "b": "enters the window",
    "c": "through the window",
    "d": "complete, toe to crest",
}
FEWEST = 40  # contacts; the fabric of fewer is not significant


class Reach(NamedTuple):
    """Highest shear strains that connect the toe with the window, with zones beyond it, and through it with the crest."""

    frame: int
    gravity_factor: float
    step: int
    enters: float
    through: float
    complete: float

    def state(self, counted: float = COUNTED) -> str:
        """Letter of the state."""
        return "abcd"[sum(value >= counted for value in (self.enters, self.through, self.complete))]


class State(NamedTuple):
    """Frames in which a state was reached and first seen, or None. `alike`: states reached in the same frame."""

    letter: str
    reach: Reach | None
    seen: Reach | None
    alike: str

    def as_text(self) -> str:
        """Text of one line with the state and the frame in which it was reached."""
        words = "not reached" if self.reach is None else f"{self.reach.gravity_factor:.2f} g, step {self.reach.step}"
        if self.alike:
            words += f", in the same frame as {' and '.join(self.alike)}"
        if self.seen and self.seen is not self.reach:
            words += f" (seen at {self.seen.gravity_factor:.2f} g, lost again)"
        return f"{self.letter} ({MEANING[self.letter]}): {words}"


class Intervals(NamedTuple):
    """Half widths of the 95 % intervals of a fabric (coupler_protocol/measures); of its directions [deg], at most 90."""

    a: float
    theta_a: float
    a_n: float
    theta_n: float


def reaches(run: Run) -> list[Reach]:
    """The last frame of the couple stage, which is the state the overload starts from, and all frames of overloads."""
    start = [run.last_frame(name) for name in run.stages_where(couples=True)]
    overloads = run.stages_where(overloads=True)
    later = [i for i, frame in enumerate(run.frames) if frame.stage in overloads]
    surface = failure.ground(run)
    return [reach(run, i, surface) for i in start + later if all(run.has(i, rank) for rank in (0, *run.windows))]


def reach(run: Run, frame: int, surface: Surface) -> Reach:
    """Reach of the band in one frame."""
    info = run.frames[frame]
    return Reach(frame, info.gravity_factor, info.step, *shear_band_states.levels(failure.cells(run, frame), surface))


def states(found: list[Reach], counted: float = COUNTED) -> list[State]:
    """State of each of the four letters; a is reached in the first of the frames."""
    held = {letter: [one.state(counted) >= letter for one in found] for letter in MEANING}
    seen = {letter: found[holds.index(True)] if any(holds) else None for letter, holds in held.items()}
    reached = {letter: _for_good(found, holds) for letter, holds in held.items()}
    return [
        State(letter, one, seen[letter], "".join(k for k, other in reached.items() if k != letter and one and other is one))
        for letter, one in reached.items()
    ]


def last_before(found: list[Reach], counted: float = COUNTED) -> Reach | None:
    """Last frame before the band has entered the window; None if it has entered in the first frame."""
    entered = states(found, counted)[1].reach
    number = found.index(entered) if entered else len(found)
    return found[number - 1] if number else None


def fabric(run: Run, frame: int, rank: int = 1, kind: str | None = None) -> tuple[Fabric, Intervals] | None:
    """Fabric of all contacts or of one kind (colluvium.results.fabric.KINDS) and its intervals; None for too few contacts."""
    try:
        whole = contact_fabric(run.discs(frame, rank), run.contacts(frame, rank), kind)
    except ValueError:
        return None
    if whole.contacts < FEWEST:
        return None
    widths = whole.a_interval[1] - whole.a, whole.theta_a_error, whole.a_n_interval[1] - whole.a_n, whole.theta_n_error
    return whole, Intervals(*widths)


def _for_good(found: list[Reach], holds: list[bool]) -> Reach | None:
    """First frame from which on all `holds` are true."""
    since = next((i + 1 for i in range(len(holds) - 1, -1, -1) if not holds[i]), 0)
    return found[since] if since < len(found) else None
