"""What is seen of the discs at points of histories between plain steps, in compiled code (plain_loop.py).

After the FORCE of such a step is sent, its Answer is computed, which the next FORCE takes along. Rows of numbers are left to
Python, which reads them after the call; only what has to be judged at once ends it.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coupler_protocol.compiled.jit import jit
from coupler_protocol.wire.messages import Answer
from dem_server.coupling.ring_guard import OPEN, some_outside, watch_ring
from dem_server.model import CAPS, SHEAR_BREAKS, TENSION_BREAKS
from dem_server.observe.energy import kinetic_kernel, stored_kernel, weight_height_kernel
from dem_server.observe.unbalanced_ratio import ratio
from dem_server.step.breaks import COLUMNS, has_bonds, note_breaks, room

RATIO, DT_LIMIT, KINETIC, STORED, POWER, BROKEN, WARNINGS, HEIGHT = (
    Answer._fields.index(name) for name in ("ratio", "dt_limit", "kinetic", "stored", "power", "broken", "warnings", "height")
)


class Sight(NamedTuple):
    """The guard of the ring, and what histories have seen.

    every: steps between points of histories; fresh (1,): whether the list of pairs is new, so that discs may have left the ring.
    spring, parallel_bond: of the law. ring (7,): see `watch_ring`; power (1,): of the ring in the last step with histories [W];
    steps (n,), answers (n,8): steps of the run at which was looked, and what was seen; rows (1,): how many. breaks (k,9): rows of
    breaks of bonds (dem_server/step/breaks.py), broken_at (k,): steps of their looks; None without bonds; broken (2,): how many
    rows, and how many bonds had broken at the last look.
    """

    every: int
    fresh: NDArray[np.bool_]
    spring: tuple
    parallel_bond: tuple | None
    ring: NDArray[np.float64]
    power: NDArray[np.float64]
    steps: NDArray[np.int64]
    answers: NDArray[np.float64]
    rows: NDArray[np.int64]
    breaks: NDArray[np.float64] | None
    broken_at: NDArray[np.int64] | None
    broken: NDArray[np.int64]


def sight_of(side, most):
    """The Sight of a stage; `most`: steps of a call."""
    law, every = side.model.law, side.record_of_stage.history
    rows = most // every + 2
    return Sight(
        every, np.zeros(1, dtype=np.bool_), law.spring, law.parallel_bond, side.guard.ring, np.array([side.power]),
        np.zeros(rows, dtype=np.int64), np.zeros((rows, len(Answer._fields))), np.zeros(1, dtype=np.int64),
        *rows_of_breaks(side.state), np.zeros(2, dtype=np.int64),
    )  # fmt: skip


def rows_of_breaks(state):
    """Rows of breaks for all bonds of a State, and their steps; None without bonds."""
    if not has_bonds(state):
        return None, None
    count = room(state)
    return np.zeros((count, COLUMNS)), np.zeros(count, dtype=np.int64)


@jit
def look(done, disc, load, weight, listed, past, clumps, ring, gravity, counters, answer, sight):
    """Looks after `done` steps of the run, with `ring` control discs, under `gravity` [m/s2]; sets `answer` (8,).

    Returns whether something has to be judged at once. listed, past: a Listed and a PairHistory.
    """
    answer[RATIO] = ratio(
        disc, load, weight, listed.first, listed.second, past.normal, past.shear, past.parallel, None, clumps, ring, gravity
    )
    answer[KINETIC] = kinetic_kernel(disc, clumps, ring)
    answer[STORED] = stored_kernel(
        disc, listed.first, listed.second, listed.kind, past.normal, past.shear, past.rolled, past.parallel,
        sight.spring, sight.parallel_bond,
    )  # fmt: skip
    answer[POWER], answer[HEIGHT] = sight.power[0], weight_height_kernel(disc, weight, clumps, ring)
    answer[BROKEN], answer[WARNINGS] = counters[TENSION_BREAKS] + counters[SHEAR_BREAKS], counters[CAPS]
    note_cracks(
        done, disc, listed, past.bond_state, past.bond_reported, past.parallel, counters,
        sight.breaks, sight.broken_at, sight.broken,
    )  # fmt: skip
    row = sight.rows[0]
    sight.steps[row] = done
    for i in range(len(answer)):  # by number: what numba compiles for arrays of two shapes takes seconds
        sight.answers[row, i] = answer[i]
    sight.rows[0] = row + 1
    noticed = watch_ring(disc, ring, sight.ring)
    if sight.fresh[0]:
        sight.fresh[0] = False
        noticed |= some_outside(disc, ring, sight.ring[OPEN] != 0.0)
    return noticed or not np.isfinite(answer[RATIO])


@jit
def note_cracks(done, disc, listed, bond_state, bond_reported, parallel, counters, breaks, broken_at, broken):
    """Adds the breaks of bonds since the last look to the rows of a Sight, if the counters have changed."""
    if breaks is not None:
        count = counters[TENSION_BREAKS] + counters[SHEAR_BREAKS]
        if count != broken[1]:
            begin = broken[0]
            end = note_breaks(disc, listed.first, listed.second, bond_state, bond_reported, parallel, breaks, begin)
            for row in range(begin, end):
                broken_at[row] = done
            broken[0], broken[1] = end, count
