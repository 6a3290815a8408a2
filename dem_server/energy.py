"""Energies of the discs, for histories and for the continuum's monitor.

Kinetic: sum m v^2 / 2 + I w^2 / 2 with the masses of the motion (scaled ones in static mode). Stored in contact springs:
sum Fn^2 / 2 kn + Fs^2 / 2 ks.
"""

from coupler_protocol.jit import jit


@jit
def kinetic_kernel(disc, clumps, first):
    """Kinetic energy [J] of discs `first`..n-1 and clumps."""
    total = 0.0
    for i in range(first, disc.shape[0]):
        if clumps is not None:  # noqa: SIM102 (numba prunes this line only if it stands alone)
            if clumps.body[i] >= 0:
                continue
        total += disc[i, 6] * (disc[i, 2] ** 2 + disc[i, 3] ** 2) + disc[i, 7] * disc[i, 4] ** 2
    if clumps is not None:
        body = clumps.motion
        for c in range(len(body)):
            total += body[c, 6] * (body[c, 2] ** 2 + body[c, 3] ** 2) + body[c, 7] * body[c, 4] ** 2
    return 0.5 * total


@jit
def stored_kernel(used, kind, normal, shear, spring):
    """Elastic energy [J] of all contacts; a pair apart carries no force."""
    total = 0.0
    for i in range(used.shape[0]):
        for s in range(used[i]):
            total += normal[i, s] ** 2 / spring.normal[kind[i, s]]
            if shear is not None:
                total += shear[i, s] ** 2 / spring.shear[kind[i, s]]
    return 0.5 * total


def kinetic(model, state):
    """Kinetic energy of the free discs and clumps [J]."""
    return kinetic_kernel(state.disc, state.clumps, model.ring)


def stored(model, state):
    """Elastic energy of all contacts [J]."""
    return stored_kernel(state.used, state.kind, state.normal, state.shear, model.law.spring)
