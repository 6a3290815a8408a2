"""Threads that run the same compiled loop, each for its share, with barriers between the phases of a step.

Waking a thread takes longer than a phase, so threads are woken once for many steps and wait for each other actively. A thread
that arrives at a barrier increments its own counter and waits until no other counter is behind.

Either all threads of a crew run one loop (`work_together`), or the others help the first one (`lead`): they wait until it orders
a phase of work (`await_order`, `order`), take their share of it, and meet again.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from coupler_protocol.compiled import threads
from coupler_protocol.compiled.jit import jit
from coupler_protocol.compiled.system_calls import rest
from coupler_protocol.compiled.waiting_words import give_way, load, store

APART = 16  # words between counters: no two threads write into the same or the next cache line
GONE = np.iinfo(np.int64).max
END = -1.0
LOOKS, PAUSE = 2000, 50  # looks of a helper for an order before it rests between them; microseconds


class Crew(NamedTuple):
    """One of `size` threads: its `rank`, counters of all threads at barriers (size * APART,), findings of all (size, APART).

    ordered (3,): the phase of work that the first thread has ordered, END when it needs no help any more, and two of its numbers.
    """

    rank: int
    size: int
    meetings: np.ndarray
    found: np.ndarray
    ordered: np.ndarray


def crew_of(size: int) -> Crew | None:
    """Crew of the first of `size` threads, None for one."""
    if size == 1:
        return None
    return Crew(0, size, np.zeros(size * APART, dtype=np.int64), np.zeros((size, APART)), np.zeros(3))


def lead(crew: Crew, work: Callable[[], Any], assist: Callable[[Crew], Any]) -> Any:
    """Returns work(), which orders phases of work, while assist(crew) runs in every other thread, until `ordered` is END.

    crew: of the first thread, for `work`. Raises the exception of any thread; the first one does not wait for a failed one.
    """
    crew.meetings[:] = 0

    def take_part(rank: int) -> Any:
        try:
            return assist(crew._replace(rank=rank)) if rank else work()
        finally:
            leave(crew, rank)

    return threads.each(take_part, [(rank,) for rank in range(crew.size)])[0]


def work_together(work: Callable[..., Any], shares: Sequence[Sequence[int]], counters: np.ndarray) -> list[Any]:
    """Returns [work(*share, counts, crew) for every share], each in a separate thread; adds their counts to `counters` (n,).

    Raises the exception of any thread; the other threads do not wait for it.
    """
    size = len(shares)
    meetings, found, ordered = np.zeros(size * APART, dtype=np.int64), np.zeros((size, APART)), np.zeros(3)
    counts = np.zeros((size, len(counters)), dtype=counters.dtype)

    def take_part(rank: int) -> Any:
        try:
            return work(*shares[rank], counts[rank], Crew(rank, size, meetings, found, ordered))
        except BaseException:
            meetings[rank * APART] = GONE
            raise

    results = threads.each(take_part, [(rank,) for rank in range(size)])
    counters += counts.sum(axis=0)
    return results


@jit
def meet(crew: Crew) -> None:
    """Waits at a barrier until all threads have arrived; everything they wrote before is then visible to all."""
    mine = crew.meetings[crew.rank * APART] + 1
    store(crew.meetings, crew.rank * APART, mine)
    for other in range(crew.size):
        while load(crew.meetings, other * APART) < mine:
            give_way()


@jit
def leave(crew: Crew, rank: int) -> None:
    """No other thread waits for the thread with this rank any more; without the first one, there is no more work."""
    if rank == 0:
        crew.ordered[0] = END
    store(crew.meetings, rank * APART, GONE)


@jit
def order(crew: Crew, phase: float, first: float, second: float) -> None:
    """Orders a phase of work, with two numbers, from the other threads, which wait for it in `meet`."""
    crew.ordered[0], crew.ordered[1], crew.ordered[2] = phase, first, second
    meet(crew)


@jit
def await_order(crew: Crew) -> None:
    """Waits in another thread for the next order of the first one, which may itself wait long, for the other side of a run."""
    mine = crew.meetings[crew.rank * APART] + 1
    store(crew.meetings, crew.rank * APART, mine)
    looks = 0
    while load(crew.meetings, 0) < mine:
        looks += 1
        if looks > LOOKS:
            rest(PAUSE)
        else:
            give_way()


@jit
def over_all_threads(crew: Crew, fast: int, quickest: float, far: bool) -> tuple[int, float, bool]:
    """Reduction over all threads: a count (sum), a number (maximum), whether something is so (of rank 0).

    In the motion of discs: bodies too fast, largest speed squared, whether walls went far.
    """
    mine = crew.found[crew.rank]
    mine[0], mine[1], mine[2] = fast, quickest, far
    meet(crew)
    total = 0
    for other in range(crew.size):
        total += int(crew.found[other, 0])
        quickest = max(quickest, crew.found[other, 1])
    return total, quickest, crew.found[0, 2] > 0.0


@jit
def part_of(crew: Crew, begin: int, end: int) -> tuple[int, int]:
    """The parts of begin..end of this thread."""
    count = end - begin
    return begin + count * crew.rank // crew.size, begin + count * (crew.rank + 1) // crew.size
