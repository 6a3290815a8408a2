"""The ring seen from the continuum: what hangs on each control disc."""

import numpy as np

from dem_server.fields import listed_pairs


def ring_contacts(model, state):
    """Springs of the ring for the interface's mass rule: control disc (m,), stiffness max(kn, ks) (m,) [N/m].

    As for the discs' own masses all listed pairs count, so that no contact can close unseen; they change
    only when the list is built (`state.builds`).
    """
    pairs = listed_pairs(state)
    stiffness = np.maximum(model.law.spring.normal, model.law.spring.shear)[pairs.kind]
    a, b = pairs.disc_a < model.ring, pairs.disc_b < model.ring
    return np.concatenate([pairs.disc_a[a], pairs.disc_b[b]]), np.concatenate([stiffness[a], stiffness[b]])
