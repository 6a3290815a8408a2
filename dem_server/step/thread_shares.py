"""How the discs of a step are shared among threads.

Free discs are numbered in space and taken in runs of `RUN` discs. To wake a thread takes as long as one thread needs for some
10,000 discs, so a second one is asked only where it gains even if it is woken for a single step (docs/design/0007).
"""

from itertools import pairwise

from coupler_protocol.compiled import threads as team

RUN = 2048  # discs
FEWEST = 8  # runs a thread needs to be worth its waking


def shares(model):
    """Free discs (first, last + 1) that each thread moves; one share where more threads would not pay."""
    free = model.count - model.ring
    threads = max(1, min(team.size(), free // (FEWEST * RUN)))
    cuts = [model.ring + free * k // threads for k in range(threads + 1)]
    return list(pairwise(cuts))
