"""Unbalanced force ratio of the discs: how far they are from rest.

    ratio = max |sum F| / mean sum |f|                                           (1)

over the free discs; F: resultant of contact forces and weight, f: each of these forces. The same words as
on the continuum's side.
"""

from coupler_protocol.jit import jit


def unbalanced_ratio(model, state, gravity):
    """Eq (1) [-]; 0 if no force acts at all."""
    return ratio(
        state.disc, state.load, state.weight, state.used, state.partner, state.normal, state.shear,
        model.ring, gravity,
    )


@jit
def ratio(disc, load, weight, used, partner, normal, shear, ring, gravity):
    """Kernel of `unbalanced_ratio`."""
    n = disc.shape[0]
    total = 0.0
    for i in range(n):
        for s in range(used[i]):
            f2 = normal[i, s] ** 2
            if shear is not None:
                f2 += shear[i, s] ** 2
            free = (1 if i >= ring else 0) + (1 if partner[i, s] >= ring else 0)
            total += free * f2**0.5
    worst = 0.0
    for i in range(ring, n):
        total += weight[i] * gravity
        worst = max(worst, load[i, 0] ** 2 + (load[i, 1] - weight[i] * gravity) ** 2)
    return worst**0.5 * (n - ring) / total if total > 0.0 else 0.0
