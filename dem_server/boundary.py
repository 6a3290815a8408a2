"""The ring seen from the continuum: what hangs on each control disc."""

import numpy as np

from dem_server.fields import listed_pairs
from dem_server.stiffness import contact_stiffnesses


def ring_contacts(model, state):
    """Springs of the ring for the interface's mass rule: control disc (m,), stiffness (m,) [N/m].

    The larger of kn and ks, bonds and dashpots included (a dashpot with twice its constant over dt, as in timestep.py). As for
    the discs' own masses all listed pairs count, so that no contact can close unseen; they change only when the list is
    built (`state.builds`) or bonds are made.
    """
    pairs = listed_pairs(state)
    stiffness = contact_stiffnesses(model, state, pairs)
    a, b = pairs.disc_a < model.ring, pairs.disc_b < model.ring
    return np.concatenate([pairs.disc_a[a], pairs.disc_b[b]]), np.concatenate([stiffness[a], stiffness[b]])
