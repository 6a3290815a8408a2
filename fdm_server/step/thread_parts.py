"""Parts of a step: strips of blocks for the cache, runs of strips for threads.

The forces of zones on a gridpoint can be summed as soon as the last zone around it is computed. When this is done strip by strip,
the corner forces are still in the cache. A thread takes a run of strips; gridpoints between two runs, the seam, are summed when
both are complete. Every sum has the order of `Model.place`, so the bits are those of one thread.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdm_server.step.blocks import LANES

STRIP = 64  # blocks: 1,024 zones, whose data fit into the cache of a core
FEWEST = 16  # strips of a thread: with fewer, waiting costs more time than threads save


class Partition(NamedTuple):
    """S strips of B blocks and N gridpoints."""

    order: NDArray[np.uint32]  # (N,) gridpoints in the order in which they are summed
    ready: NDArray[np.uint32]  # (S+2,) order[ready[s]:ready[s + 1]] are summed after strip s; s = S: the seam
    strips: list[tuple[int, int]]  # first and last strip of each thread
    points: list[tuple[int, int]]  # first and last gridpoint of each thread


def build_partition(zones, points, threads):
    """Partition for zones (A,4) in blocks of their order and N = points gridpoints, for at most `threads` threads."""
    strip = np.repeat(np.arange(len(zones)) // (STRIP * LANES), 4)
    count = int(strip[-1]) + 1
    runs = max(1, min(threads, count // FEWEST))
    bounds = [count * k // runs for k in range(runs + 1)]
    first = np.full(points, count)
    last = np.zeros(points, dtype=np.int64)  # gridpoints without a zone belong to the first strip
    np.minimum.at(first, zones.ravel(), strip)
    np.maximum.at(last, zones.ravel(), strip)
    run = np.searchsorted(bounds, (np.minimum(first, last), last), side="right")
    after = np.where(run[0] == run[1], last, count)
    order = np.argsort(after, kind="stable")
    ready = np.searchsorted(after[order], np.arange(count + 2))
    cuts = [points * k // runs for k in range(runs + 1)]
    return Partition(order.astype(np.uint32), ready.astype(np.uint32), list(pairwise(bounds)), list(pairwise(cuts)))
