"""Springs of the contacts of the ring's control discs."""

from typing import NamedTuple

import numpy as np

from dem_server.pairs import levers, listed_pairs
from dem_server.step.stiffness import pair_stiffnesses


class RingContacts(NamedTuple):
    """Springs of the ring (m,).

    disc: control disc; normal (m, 2): unit vector from it; lever [m]: from its centre to the contact; kn, ks [N/m], kr [N m].
    """

    disc: np.ndarray
    normal: np.ndarray
    lever: np.ndarray
    kn: np.ndarray
    ks: np.ndarray
    kr: np.ndarray


def ring_contacts(model, state):
    """Springs of the ring for the interface's mass rule.

    Bonds and dashpots are included (a dashpot counts with twice its constant over dt, as in dem_server/step/masses.py). As for
    the masses of discs, all listed pairs count, so that no contact can close unnoticed. The pairs change when the list is built
    (`state.builds`) or bonds are made. Bonds that break only remove springs.
    """
    # the first disc of a pair has the lower number, and no pair has both discs on the ring
    pairs = listed_pairs(state, np.flatnonzero(state.first < model.ring))
    return RingContacts(pairs.disc_a, pairs.normal, levers(state, pairs)[0], *pair_stiffnesses(model, state, pairs))
