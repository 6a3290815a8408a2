"""Breaks of bonds as rows of a list: none is missed, and kernels of steps do nothing for them.

A bond breaks in the contact law, which only changes its state. A pair whose state is broken and whose history `reported` is 0 is
a break that nobody has seen. `collect` makes a row of it and sets `reported` to 1: at looks (points of histories, frames),
before a new list of pairs drops pairs, and before a stage changes the law. The rows wait in State.breaks until a look gives them
its step and time: a break is dated to the first look after it. So the list does not depend on when lists are built, on
checkpoints, or on how many steps are taken in one call. Scenes without bonds have none of these arrays.
"""

import numpy as np

from coupler_protocol.compiled.jit import jit
from dem_server.effects.bond import BONDED, BROKEN_TENSION
from dem_server.model import RADIUS, X, Y

PLACE_X, PLACE_Y, NORMAL_X, NORMAL_Y, SIZE, FIRST, SECOND, MODE, KIND, COLUMNS = range(10)  # of a row, and their number
CONTACT_BOND, PARALLEL_BOND = range(2)  # values of KIND


@jit
def note_breaks(disc, first, second, bond_state, bond_reported, parallel, rows, begin):
    """Writes breaks that were not reported into rows begin.. of `rows`; returns the row after the last one.

    Rows that have no room wait for the next look. PLACE: point of contact [m]; NORMAL: from first to second disc; SIZE: diameter
    of the smaller disc [m]; MODE: BROKEN_TENSION or BROKEN_SHEAR.
    """
    row = begin
    if bond_state is not None:
        row = note_states(disc, first, second, bond_state, bond_reported, 1.0 * CONTACT_BOND, rows, row)
    if parallel is not None:
        row = note_states(disc, first, second, parallel.state, parallel.reported, 1.0 * PARALLEL_BOND, rows, row)
    return row


@jit
def note_states(disc, first, second, states, reported, kind, rows, row):
    """`note_breaks` for bonds of one kind."""
    for p in range(len(first)):
        if states[p] < BROKEN_TENSION or reported[p] != 0 or row == len(rows):
            continue
        i, j = first[p], second[p]
        dx, dy = disc[j, X] - disc[i, X], disc[j, Y] - disc[i, Y]
        d = (dx * dx + dy * dy) ** 0.5
        nx, ny = dx / d, dy / d
        lever = 0.5 * (d + disc[i, RADIUS] - disc[j, RADIUS])
        rows[row, PLACE_X], rows[row, PLACE_Y] = disc[i, X] + lever * nx, disc[i, Y] + lever * ny
        rows[row, NORMAL_X], rows[row, NORMAL_Y] = nx, ny
        rows[row, SIZE] = 2.0 * min(disc[i, RADIUS], disc[j, RADIUS])
        rows[row, FIRST], rows[row, SECOND] = i, j
        rows[row, MODE], rows[row, KIND] = states[p], kind
        reported[p] = 1
        row += 1
    return row


def has_bonds(state):
    """Whether the law of the State has bonds."""
    return state.bond_state is not None or state.parallel is not None


def room(state):
    """Largest number of breaks that the present list of pairs can still report."""
    states = [] if state.bond_state is None else [(state.bond_state, state.bond_reported)]
    states += [] if state.parallel is None else [(state.parallel.state, state.parallel.reported)]
    return sum(int(np.count_nonzero((s == BONDED) | ((s >= BROKEN_TENSION) & (r == 0)))) for s, r in states)


def collect(state):
    """Adds all breaks that were not reported to State.breaks (k, COLUMNS)."""
    if not has_bonds(state):
        return
    fresh = 0 if state.bond_state is None else np.count_nonzero(_not_reported(state.bond_state, state.bond_reported))
    fresh += 0 if state.parallel is None else np.count_nonzero(_not_reported(state.parallel.state, state.parallel.reported))
    if fresh:
        rows = np.empty((fresh, COLUMNS))
        note_breaks(*arguments(state, rows))
        state.breaks = rows if state.breaks is None else np.concatenate([state.breaks, rows])


def arguments(state, rows):
    """Arguments of `note_breaks` for all rows."""
    bonds = state.bond_state, state.bond_reported, state.parallel
    return state.disc, state.first, state.second, *bonds, rows, np.int64(0)


def take(state):
    """Collects, and returns all rows that wait (k, COLUMNS); None if there are none. They wait no longer."""
    collect(state)
    rows, state.breaks = state.breaks, None
    return rows


def _not_reported(states, reported):
    return (states >= BROKEN_TENSION) & (reported == 0)


def as_columns(rows, material, origin=(0.0, 0.0)):
    """Columns of coupler_protocol.files.quantities.CRACKS of rows (k, COLUMNS), but for step and time.

    material (n,): of the discs; origin [m]: the local origin of the State.
    """
    ends = rows[:, [FIRST, SECOND]].astype(np.int64)
    return {
        "place": rows[:, [PLACE_X, PLACE_Y]] + np.asarray(origin),
        "normal": rows[:, [NORMAL_X, NORMAL_Y]],
        "size": rows[:, SIZE],
        "disc_a": ends[:, 0],
        "disc_b": ends[:, 1],
        "material_a": material[ends[:, 0]].astype(np.int32),
        "material_b": material[ends[:, 1]].astype(np.int32),
        "mode": rows[:, MODE].astype(np.int32),
        "bond": rows[:, KIND].astype(np.int32),
    }
