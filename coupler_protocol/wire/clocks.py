"""Clocks of a link: how long a side waits in each phase of a run, and the words with which it gives up.

Every wait has two bounds: the clock of its phase, and `give_up` for a peer without a connection. In a phase in which the peer
computes for long, each PROGRESS starts its clock again, and `phase` bounds the whole wait. docs/protocol.md lists all waits.
"""

import time
from typing import Any, NamedTuple

from coupler_protocol.wire import messages

SLICE = 0.2  # seconds between checks of the clocks and of the stop request while waiting
REPORT = 10.0  # seconds between two messages PROGRESS, at most


class Phase(NamedTuple):
    """Part of a run in which one side waits for a message of the other.

    clock: key of [link]; restarts: whether PROGRESS starts that clock again; due: what the peer does meanwhile.
    """

    name: str
    clock: str
    restarts: bool
    due: str


ARRIVAL = Phase("arrival", "arrival", False, "starts and joins the run")
PACKING = Phase("packing", "progress", True, "fills its window with discs")
FIELD = Phase("field", "progress", True, "computes the stages before the one that fills the windows")
STRESS = Phase("stress", "progress", True, "brings its discs to the stress of the zones")
GO = Phase("go", "progress", True, "computes the stages before the first coupled one")
STEPS = Phase("steps", "step", True, "computes a step")
FAREWELL = Phase("farewell", "farewell", False, "closes its files")

PHASES = {  # in which a side waits for a message of that kind
    messages.HELLO: ARRIVAL,
    messages.WELCOME: ARRIVAL,
    messages.PACKED: PACKING,
    messages.FIELD: FIELD,
    messages.READY: STRESS,
    messages.GO: GO,
    messages.FORCE: STEPS,
    messages.VELOCITY: STEPS,
    messages.STOP: STEPS,
    messages.FAREWELL: FAREWELL,
}


class Clocks:
    """Clocks [s] from the table [link] of a scene, with the meanings of its keys.

    slice: between two looks at the clocks; report: between two messages PROGRESS.
    """

    def __init__(self, link: Any) -> None:
        self.timeout = min(link.timeout, link.give_up)
        self.give_up, self.phase = link.give_up, link.phase
        self.arrival, self.progress, self.step, self.farewell = link.arrival, link.progress, link.step, link.farewell
        self.slice = min(SLICE, self.timeout)
        self.report = min(REPORT, 0.25 * link.progress, 0.25 * link.step)


class Waiting(NamedTuple):
    """A wait that lasts, for people: for whom, in which phase, for which message, since when, last PROGRESS of the peer."""

    peer: str
    phase: str
    message: str
    since: float  # [s] since 1970
    word: str


class Wait:
    """One wait for a peer, from now on. kinds: of the messages that end it; name: of the peer; log: name of its log."""

    def __init__(self, clocks: Clocks, kinds: tuple[int, ...], name: str, log: str) -> None:
        self.clocks, self.phase, self.name, self.log = clocks, PHASES[kinds[0]], name, log
        self._kinds = " or ".join(messages.NAMES[kind] for kind in kinds)
        self.begin = self.connected = self._word = time.monotonic()
        self._since, self._last_word = time.strftime("%H:%M:%S"), ""
        self.told = Waiting(name, self.phase.name, self._kinds, time.time(), "")

    def note_word(self, text: str) -> None:
        """Starts the clock of the phase again after PROGRESS, if it counts in this phase."""
        if self.phase.restarts:
            self._word = time.monotonic()
            self._last_word = f"; its last word, at {time.strftime('%H:%M:%S')}: {text}"
            self.told = self.told._replace(word=text)

    def over(self, now: float) -> str | None:
        """Text of why the peer counts as lost, or None. `connected` must be the last time at which it was, `now` if it is."""
        clocks, clock = self.clocks, self.phase.clock
        silent, limit = now - self.connected, clocks.arrival if self.phase is ARRIVAL else clocks.give_up
        if silent > limit:
            key = "arrival" if self.phase is ARRIVAL else "give_up"
            return self._words("not connected", silent, key, limit, "the network and the address")
        there = "connected" if silent == 0.0 else "not connected now"
        if (waited := now - self._word) > (limit := getattr(clocks, clock)):
            said = "no message of it" if self.phase.restarts else f"no {self._kinds}"
            return self._words(f"{there}, but {said}", waited, clock, limit, "whether another program has taken its place")
        if (waited := now - self.begin) > clocks.phase:
            return self._words(f"{there}, but no {self._kinds}", waited, "phase", clocks.phase, "whether it needs more time")
        return None

    def _words(self, problem: str, seconds: float, key: str, limit: float, also: str) -> str:
        return (
            f"{self.name} was lost: {problem} for {seconds:.1f} s (link.{key} = {limit:g} s); phase {self.phase.name}, "
            f"{self._kinds} awaited since {self._since}{self._last_word}; check that the process runs and "
            f"{self.phase.due}, its {self.log}, and {also}"
        )
