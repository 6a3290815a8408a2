"""Masses of the static mode: with dt = 1 each disc gets the mass that makes its own springs stable.

    m = k / sf^2,   k = max(sum kn nx^2 + ks ny^2,  sum kn ny^2 + ks nx^2)      (1)
    I = sum ks r^2 / sf^2                                                        (2)

The sums run over all listed pairs, whether they touch or not: every contact that can close before the next
list is built has been counted. The hardest case is a contact by itself with ks = kn, two discs sliding and
rolling on each other: omega^2 = 4 sf^2. In packings it is 2 to 3 sf^2 (largest eigenvalue). A step is stable
for omega^2 <= 4 / (1 + alpha) with local damping alpha, hence

    sf = min(0.75, 0.98 / sqrt(1 + alpha)).                                      (3)

Gravity acts on the real mass (`State.weight`). Sources: Underwood (1983), Dynamic relaxation, in:
Computational Methods for Transient Analysis, ch. 5; Itasca, PFC2D 3.1 Theory, "Determination of the critical
timestep" and "Density scaling".
"""

import numpy as np

from coupler_protocol.jit import jit
from dem_server.clumps import clump_masses


def safety(damping):
    """Eq (3) [-]; `damping`: the law's DampingTable or None."""
    alpha = 0.0 if damping is None else damping.local
    return min(0.75, 0.98 / (1.0 + alpha) ** 0.5)


def set_static_masses(model, state):
    """Set mass and inertia of all discs, Eqs (1) and (2), and of the clumps, from the listed pairs."""
    pairs = state.disc, state.used, state.partner, state.kind, model.law.spring, safety(model.law.damping)
    static_masses(*pairs)
    if state.clumps is not None:
        clump_masses(state.clumps, *pairs)


@jit
def static_masses(disc, used, partner, kind, spring, sf):
    """Kernel of `set_static_masses`. Without pairs a disc gets the mass for one spring; I >= m r^2 / 2."""
    n = disc.shape[0]
    stiff = np.zeros((n, 3))
    for i in range(n):
        for s in range(used[i]):
            j = partner[i, s]
            dx, dy = disc[j, 0] - disc[i, 0], disc[j, 1] - disc[i, 1]
            nx2 = dx * dx / (dx * dx + dy * dy)
            kn, ks = spring.normal[kind[i, s]], spring.shear[kind[i, s]]
            for a in (i, np.int64(j)):
                stiff[a, 0] += kn * nx2 + ks * (1.0 - nx2)
                stiff[a, 1] += kn * (1.0 - nx2) + ks * nx2
                stiff[a, 2] += ks * disc[a, 5] ** 2
    floor = spring.normal.max()
    for i in range(n):
        disc[i, 6] = max(stiff[i, 0], stiff[i, 1], floor) / sf**2
        disc[i, 7] = max(stiff[i, 2] / sf**2, 0.5 * disc[i, 6] * disc[i, 5] ** 2)
