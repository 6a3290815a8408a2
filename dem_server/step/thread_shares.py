"""Distribution of the discs of a step among threads.

Free discs are numbered in space and distributed in runs of `RUN` discs. Waking a thread takes as long as one thread needs for
about 10,000 discs, so a second thread is used only if it gains time even when woken for a single step (docs/design/0007).
"""

from itertools import pairwise

from coupler_protocol.compiled import threads as team

RUN = 2048  # discs
FEWEST = 8  # runs for which waking a thread gains time


def shares(model):
    """Free discs (first, last + 1) of each thread; one share if more threads would not gain time."""
    free = model.count - model.ring
    threads = min(team.size(), free // (FEWEST * RUN))
    if threads <= 1:
        return [(model.ring, model.count)]  # the usual case, in every step
    cuts = [model.ring + free * k // threads for k in range(threads + 1)]
    return list(pairwise(cuts))
