"""Threads that go through the same compiled loop, each with its share, and meet between the phases of a step.

To wake a thread takes longer than a phase, so they are woken once for many steps and wait for each other awake. Whoever
arrives counts its meetings in a word of its own and waits until no other word is behind.
"""

from typing import NamedTuple

import numpy as np

from coupler_protocol.compiled import threads
from coupler_protocol.compiled.jit import jit
from coupler_protocol.compiled.waiting_words import give_way, load, store

APART = 16  # words: no two threads write into the same or the next cache line
GONE = np.iinfo(np.int64).max


class Crew(NamedTuple):
    """What one of `size` threads knows: its `rank`, all their meetings (size * APART,) and what each found (size, APART)."""

    rank: int
    size: int
    meetings: np.ndarray
    found: np.ndarray


def work_together(work, shares, counters):
    """[work(*share, counts, crew) for every share], each in a thread of its own; adds what they counted to `counters` (n,).

    An exception of any of them is raised here; the others do not wait for it.
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
    """Wait until all have come as far as this one; what they wrote before is then there for all."""
    mine = crew.meetings[crew.rank * APART] + 1
    store(crew.meetings, crew.rank * APART, mine)
    for other in range(crew.size):
        while load(crew.meetings, other * APART) < mine:
            give_way()


@jit
def over_all_threads(crew, fast, quickest, far):
    """Bodies too fast (sum), largest speed squared (largest) and whether walls went far (of rank 0), of all the threads."""
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
    """The parts of begin..end that fall to this thread."""
    count = end - begin
    return begin + count * crew.rank // crew.size, begin + count * (crew.rank + 1) // crew.size
