"""Reactions: forces of boundaries on the ground that keep its prescribed velocity.

On a component that is not free the reaction balances the other forces (of zones, applied, weight):

    R = -(F_zones + F_applied + m g)        summed over the gridpoints of a boundary
"""

import numpy as np


def reactions(model, state, gravity, holders):
    """Forces {name: {"x": .., "y": ..}} [N] of boundaries on the ground.

    holders: {name: (gridpoints held in x, gridpoints held in y)}; components that are free now do not count.
    """
    found = {}
    for label, by_axis in holders.items():
        found[label] = {}
        for axis, points in enumerate(by_axis):
            if len(points):
                held = points[model.fixed[points, axis]]
                force = state.force[held, axis] + state.applied[held, axis]
                if axis == 1:
                    force = force - gravity * model.weight_mass[held]
                found[label]["xy"[axis]] = 0.0 - float(np.sum(force))
    return found
