"""Threads that run the same compiled loop, each for its share, with barriers between the phases of a step.

Waking a thread takes longer than a phase, so threads are woken once for many steps and wait for each other actively. A thread
that arrives at a barrier increments its own counter and waits until no other counter is behind.
"""

from typing import NamedTuple

import numpy as np

from coupler_protocol.compiled import threads
from coupler_protocol.compiled.jit import jit
from coupler_protocol.compiled.waiting_words import give_way, load, store

APART = 16  # words between counters: no two threads write into the same or the next cache line
GONE = np.iinfo(np.int64).max


class Crew(NamedTuple):
    """One of `size` threads: its `rank`, counters of all threads at barriers (size * APART,), findings of all (size, APART)."""

    rank: int
    size: int
    meetings: np.ndarray
    found: np.ndarray


def work_together(work, shares, counters):
    """Returns [work(*share, counts, crew) for every share], each in a separate thread; adds their counts to `counters` (n,).

    Raises the exception of any thread; the other threads do not wait for it.
    """
    size = len(shares)
    meetings, found = np.zeros(size * APART, dtype=np.int64), np.zeros((size, APART))
    counts = np.zeros((size, len(counters)), dtype=counters.dtype)

    def take_part(rank):
        try:
            return work(*shares[rank], counts[rank], Crew(rank, size, meetings, found))
        except BaseException:
            meetings[rank * APART] = GONE
            raise

    results = threads.each(take_part, [(rank,) for rank in range(size)])
    counters += counts.sum(axis=0)
    return results


@jit
def meet(crew):
    """Waits at a barrier until all threads have arrived; everything they wrote before is then visible to all."""
    mine = crew.meetings[crew.rank * APART] + 1
    store(crew.meetings, crew.rank * APART, mine)
    for other in range(crew.size):
        while load(crew.meetings, other * APART) < mine:
            give_way()


@jit
def over_all_threads(crew, fast, quickest, far):
    """Reduction over all threads: bodies too fast (sum), largest speed squared (maximum), whether walls went far (of rank 0)."""
    mine = crew.found[crew.rank]
    mine[0], mine[1], mine[2] = fast, quickest, far
    meet(crew)
    total = 0
    for other in range(crew.size):
        total += int(crew.found[other, 0])
        quickest = max(quickest, crew.found[other, 1])
    return total, quickest, crew.found[0, 2] > 0.0


@jit
def part_of(crew, begin, end):
    """The parts of begin..end of this thread."""
    count = end - begin
    return begin + count * crew.rank // crew.size, begin + count * (crew.rank + 1) // crew.size
