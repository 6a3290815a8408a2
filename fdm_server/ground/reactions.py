"""Reactions: forces of boundaries on the ground that keep its prescribed velocity.

On a component that is not free the reaction balances the other forces (of zones, applied, weight):

    R = -(F_zones + F_applied + m g)        summed over the gridpoints of a boundary
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coupler_protocol.compiled.jit import jit


class Held(NamedTuple):
    """Held components of H boundaries, for `add_up`: gridpoints of all, begin (H+1,): first one of a boundary, axis (H,)."""

    points: NDArray[np.int64]
    begin: NDArray[np.int64]
    axis: NDArray[np.int64]


@jit
def add_up(held, force, applied, weight_mass, gravity, found):
    """Sets found (H,): the reactions above [N]."""
    points, begin, axes = held
    for h in range(len(axes)):
        axis, total = axes[h], 0.0
        for i in range(begin[h], begin[h + 1]):
            n = points[i]
            own = force[n, axis] + applied[n, axis]
            total += own - gravity * weight_mass[n] if axis == 1 else own
        found[h] = 0.0 - total


def held_components(fixed, holders):
    """Names (boundary, axis) and the Held of all components that `holders` names and that are not free now.

    holders: {name: (gridpoints held in x, gridpoints held in y)}.
    """
    names, points = [], []
    for label, by_axis in holders.items():
        for axis, own in enumerate(by_axis):
            if len(own):
                names.append((label, axis))
                points.append(own[fixed[own, axis]])
    begin = np.cumsum([0, *map(len, points)])
    return names, Held(
        np.concatenate([np.zeros(0, dtype=np.int64), *points]), begin, np.array([a for _, a in names], dtype=np.int64)
    )


def reactions(model, state, gravity, holders):
    """Forces {name: {"x": .., "y": ..}} [N] of boundaries on the ground.

    holders: {name: (gridpoints held in x, gridpoints held in y)}; components that are free now do not count.
    """
    names, held = held_components(model.fixed, holders)
    forces = np.zeros(len(names))
    add_up(held, state.force, state.applied, model.weight_mass, float(gravity), forces)
    found = {label: {} for label in holders}
    for (label, axis), force in zip(names, forces.tolist(), strict=True):
        found[label]["xy"[axis]] = force
    return found
