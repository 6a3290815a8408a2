"""Removal of strong overlaps of discs from a file without setting them in motion.

Overlaps are stored energy. With the overlap d of two discs of the contact stiffness kn

    E = sum kn d^2 / 2                                                           (1)

is reported. discs_of_a_file.py has the rules of refusal. Before a static stage, discs that overlap by more than BURST of the
smaller radius are pushed apart by steps from rest, x += F / m, so that none of this energy becomes motion. This ends when no
overlap exceeds LEFT or when the walls prevent it.
"""

import numpy as np

from dem_server.model import CAPS
from dem_server.packing.discs_of_a_file import BURST
from dem_server.pairs import listed_pairs
from dem_server.step import cycle
from dem_server.step.contact_pass import contact_forces
from dem_server.step.motion import move_free

LEFT = 1e-3  # of the smaller radius: largest overlap that remains
APART, LOOK = 5000, 50  # largest number of steps, and steps between checks of their progress


def separate_discs(model, state):
    """Separates discs if any overlap exceeds BURST, walls held; returns the model, in static mode, and steps and overlap left.

    The shear forces of all contacts are set to zero.
    """
    deepest = largest_overlap(state)
    if deepest <= BURST:
        return model, {}
    model, steps, before = cycle.in_static_mode(model, state), 0, np.inf
    contact_forces(model, state)
    while steps < APART and deepest > LEFT and deepest < 0.99 * before:
        for _ in range(LOOK):
            move_free(model, state, 0.0)
            cycle.stop(state)
            contact_forces(model, state)
        steps, before, deepest = steps + LOOK, deepest, largest_overlap(state)
    if state.shear is not None:
        state.shear[:] = 0.0
    state.counters[CAPS] = 0
    return model, {"drawn_apart_steps": steps, "overlap_left": deepest}


def largest_overlap(state):
    """Largest overlap of two listed discs over the smaller radius [-]."""
    pairs = listed_pairs(state)
    smaller = np.minimum(state.radius[pairs.disc_a], state.radius[pairs.disc_b])
    return float((-pairs.gap / smaller).max(initial=0.0))
