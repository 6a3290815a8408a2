"""What is seen of the grid at points of histories between plain steps, in compiled code (fdm_server/coupling/plain_loop.py).

In the middle of the step after such a point the watches of the stage measure, and the ratios of both codes are compared with the
limits of the stage; after the step before, histories get their values. Rows of numbers are left to Python, which reads them
after the call; only what has to be judged at once ends it.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coupler_protocol.compiled.jit import jit
from coupler_protocol.wire.messages import Answer
from fdm_server.coupling.rim_stretch import Stretch, watch_stretch
from fdm_server.ground.reactions import Held, add_up, held_components
from fdm_server.observe.energy_growth import Balance, watch_energy
from fdm_server.step.gridpoint_pass import farthest, fastest_component, imbalance_kernel, kinetic_kernel, ratio_of

RATIO_OF_DISCS = Answer._fields.index("ratio")
DONE, RATIO, LARGEST, FARTHEST, LOOKED = range(5)  # columns of Sight.looks, and their number
STEP, LAST_RATIO, FACTOR, KINETIC, FAR, REACTIONS = range(6)  # columns of Sight.points; one for every held boundary from the last
NAMES = {"unbalanced_ratio": LAST_RATIO, "gravity_factor": FACTOR, "kinetic_energy": KINETIC, "max_displacement": FAR}


class Sight(NamedTuple):
    """The watches of a stage, and what they and the histories have seen.

    every: steps between points of histories; extent [m] of the grid; limits (2,): ratio and displacement that end the stage, NaN
    without one. looks (n,4): number of steps done, ratio of the grid, largest ratio of both codes, largest displacement [m];
    points (n,5+H): see `values`; rows (2,): how many of both; ratio (1,): of the last look.
    """

    every: int
    extent: float
    limits: NDArray[np.float64]
    balance: Balance
    stretch: Stretch
    held: Held
    looks: NDArray[np.float64]
    points: NDArray[np.float64]
    rows: NDArray[np.int64]
    ratio: NDArray[np.float64]


class Moved(NamedTuple):
    """Displacements of the H held boundaries of a Sight, P components in all, where boundaries move or have moved.

    driven (N,2) [m/step]: of State. displacement (n,P) [m]: of the held components at the points of histories; moves (n,H):
    whether a boundary is driven or not at its place. The means are left to Python, whose sums have an order of their own.
    """

    driven: NDArray[np.float64]
    displacement: NDArray[np.float64]
    moves: NDArray[np.bool_]


def sight_of(side, stage, most):
    """The Sight of a coupled stage and (boundary, axis) of its Held; `most`: steps of a call."""
    names, held = held_components(side.model.fixed, stage.sides.holders)
    every, until = stage.record.history, stage.stage.until
    count = most // every + 2
    limits = [np.nan if limit is None else limit for limit in (until.ratio, until.displacement)]
    sight = Sight(
        every, float(side.model.extent), np.array(limits), stage.energy.balance, stage.stretch.stretch, held,
        np.zeros((count, LOOKED)), np.zeros((count, REACTIONS + len(names))), np.zeros(2, dtype=np.int64), np.zeros(1),
    )  # fmt: skip
    return sight, names


def moved_of(sight, driven):
    """The Moved beside a Sight; driven (N,2): of State, None: no boundary has moved yet, and there is no Moved."""
    if driven is None:
        return None
    rows, held = len(sight.points), sight.held
    return Moved(driven, np.zeros((rows, len(held.points))), np.zeros((rows, len(held.axis)), dtype=np.bool_))


@jit
def look(rims, points, arrays, gravity, seconds, sight):
    """Looks at motion, energies and rims in the middle of a step; returns whether something has to be judged at once.

    points, arrays: of `plain_loop`; seconds [s]: length of the step.
    """
    applied, added_mass, mass, weight_mass, fixed, _ = points
    velocity, displacement, _, _, force = arrays
    noticed = not fastest_component(velocity) * seconds <= sight.extent
    noticed |= watch_energy(
        force, applied, weight_mass, mass, added_mass, fixed, gravity, velocity, displacement,
        rims.nodes, rims.force, rims.answer, sight.balance,
    )  # fmt: skip
    return noticed | watch_stretch(displacement, sight.stretch)


@jit
def compare(done, rims, points, gather, arrays, gravity, sight):
    """Compares ratios and displacement with the limits of the stage, after `done` steps of the run; returns whether it ends."""
    applied, _, _, weight_mass, fixed, _ = points
    _, _, start, place = gather
    _, displacement, _, corner_force, force = arrays
    ratio = ratio_of(*imbalance_kernel(start, place, corner_force, force, applied, weight_mass, fixed, gravity))
    largest, far = ratio, farthest(displacement)
    for w in range(len(rims.answer)):
        largest = max(largest, rims.answer[w, RATIO_OF_DISCS])
    row = sight.looks[sight.rows[0]]
    row[DONE], row[RATIO], row[LARGEST], row[FARTHEST] = done, ratio, largest, far
    sight.rows[0] += 1
    sight.ratio[0] = ratio
    return largest <= sight.limits[0] or far >= sight.limits[1]


@jit
def note(done, factor, points, arrays, gravity, sight):
    """Notes the values of histories after `done` steps of the run; factor: of the gravity [m/s2] of the last one."""
    applied, added_mass, mass, weight_mass, _, _ = points
    velocity, displacement, _, _, force = arrays
    row = sight.points[sight.rows[1]]
    row[STEP], row[LAST_RATIO], row[FACTOR] = done, sight.ratio[0], factor
    row[KINETIC], row[FAR] = kinetic_kernel(mass, added_mass, velocity), farthest(displacement)
    add_up(sight.held, force, applied, weight_mass, gravity, row[REACTIONS:])
    sight.rows[1] += 1


@jit
def note_moved(moved, displacement, sight):
    """Notes the displacements (N,2) [m] of held boundaries in the row that `note` has filled; moved: a Moved or None."""
    if moved is not None:
        points, begin, axes = sight.held
        row = sight.rows[1] - 1
        for h in range(len(axes)):
            moves = False
            for i in range(begin[h], begin[h + 1]):
                at = displacement[points[i], axes[h]]
                moved.displacement[row, i] = at
                moves |= at != 0.0 or moved.driven[points[i], axes[h]] != 0.0
            moved.moves[row, h] = moves


def values(sight, names):
    """Steps, and values {name: list} of the histories noted at them; names: (boundary, axis) of the Held."""
    found = sight.points[: sight.rows[1]]
    columns = NAMES | {f"reaction_{'xy'[axis]}:{label}": REACTIONS + row for row, (label, axis) in enumerate(names)}
    return found[:, STEP].astype(int).tolist(), {name: found[:, column].tolist() for name, column in columns.items()}


def movements(sight, moved, names):
    """Steps and mean displacements {name: (list, list [m])} of boundaries that move, as fdm_server.observe.record.movements."""
    count, begin = int(sight.rows[1]), sight.held.begin
    steps = sight.points[:count, STEP].astype(int)
    found = {}
    for h, (label, axis) in enumerate(names):
        rows = np.flatnonzero(moved.moves[:count, h])
        means = [float(np.mean(moved.displacement[row, begin[h] : begin[h + 1]])) for row in rows]
        if means:
            found[f"moved_{'xy'[axis]}:{label}"] = steps[rows].tolist(), means
    return found
