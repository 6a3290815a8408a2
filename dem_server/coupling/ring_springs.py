"""Springs of the contacts of the ring's control discs."""

from typing import NamedTuple

import numpy as np

from coupler_protocol.compiled.jit import jit
from coupler_protocol.compiled.system_calls import hypot
from dem_server.effects.bond import BONDED
from dem_server.model import RADIUS, X, Y
from dem_server.step.compiled_laws import dashpots_of_pair, effective_radius, stiffness_of_pair


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
    # the first disc of a pair has the lower number, no pair has both discs on the ring, and its pairs are first in the list
    law, count = model.law, int(state.parts[0, 1])
    kn, ks, kr = np.zeros((3, count))
    found = RingContacts(np.zeros(count, dtype=np.int64), np.zeros((count, 2)), np.zeros(count), kn, ks, kr)
    springs_of_ring(
        found, state.disc, state.first, state.second, state.kind, state.reference_gap, state.bond_state, state.parallel,
        state.root_mass, law.has_shear, state.next_dt, law.spring, law.rolling, law.parallel_bond, law.dashpot,
    )  # fmt: skip
    return found


@jit
def springs_of_ring(
    found, disc, first, second, kind, reference_gap, bond_state, parallel, root_mass, has_shear, next_dt,
    spring, rolling, parallel_bond, dashpot,
):  # fmt: skip
    """Kernel of `ring_contacts`: writes the springs of the first pairs of the list."""
    for p in range(len(found.disc)):
        i, j, k = first[p], second[p], kind[p]
        x, y, ri, rj = disc[j, X] - disc[i, X], disc[j, Y] - disc[i, Y], disc[i, RADIUS], disc[j, RADIUS]
        distance = hypot(x, y)
        gap = distance - ri - rj
        reference, glued, there = 0.0, False, False
        if reference_gap is not None:
            reference = reference_gap[p]
        if bond_state is not None:
            there |= bond_state[p] == BONDED
        if parallel is not None:
            glued = parallel.state[p] == BONDED
        if not (there or glued or gap - reference < 0.0):
            gap = min(gap, 0.0)  # without contact as if they touched
        kn, ks, kr = stiffness_of_pair(k, effective_radius(ri, rj), min(ri, rj), glued, spring, rolling, parallel_bond)
        if not has_shear:
            ks = 0.0
        if dashpot is not None:
            cn, cs = dashpots_of_pair(k, 2.0 / next_dt * root_mass[p], dashpot)
            kn, ks = kn + cn, ks + cs
        found.disc[p], found.normal[p, 0], found.normal[p, 1] = i, x / distance, y / distance
        found.lever[p], found.kn[p], found.ks[p], found.kr[p] = ri + 0.5 * gap, kn, ks, kr
