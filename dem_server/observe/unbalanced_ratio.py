"""Unbalanced force ratio of the discs.

    ratio = max |sum F| / mean sum |f|                                           (1)

over the free bodies, discs and clumps; F: resultant of contact forces and weight, f: each of these forces.
The continuum uses the same definition.
"""

from coupler_protocol.compiled.jit import jit
from dem_server.model import FX, FY
from dem_server.step.clumps import resultant


def unbalanced_ratio(model, state, gravity):
    """Eq (1) [-]; 0 if no force acts at all, NaN if a force is NaN or infinite."""
    return ratio(
        state.disc,
        state.load,
        state.weight,
        state.first,
        state.second,
        state.normal,
        state.shear,
        state.parallel,
        state.walls,
        state.clumps,
        model.ring,
        gravity,
    )


@jit
def ratio(disc, load, weight, first, second, normal, shear, parallel, walls, clumps, ring, gravity):
    """Kernel of `unbalanced_ratio`."""
    n = disc.shape[0]
    total = 0.0
    for p in range(len(first)):
        fn, fs = normal[p], 0.0
        if shear is not None:
            fs = shear[p]
        if parallel is not None:
            fn += parallel.normal[p]
            fs += parallel.shear[p]
        f2 = fn**2
        if shear is not None:
            f2 += fs**2
        free = (1 if first[p] >= ring else 0) + (1 if second[p] >= ring else 0)
        total += free * f2**0.5
    if walls is not None:
        for i in range(ring, n):
            for w in range(walls.normal.shape[1]):
                total += (walls.normal[i, w] ** 2 + walls.shear[i, w] ** 2) ** 0.5
    worst, broken, bodies = 0.0, 0.0, n - ring  # broken: NaN if a force is NaN or infinite, which a maximum would pass over
    for i in range(ring, n):
        total += weight[i] * gravity
        if clumps is not None:  # noqa: SIM102 (numba prunes this line only if it stands alone)
            if clumps.body[i] >= 0:
                bodies -= 1
                continue
        square = load[i, FX] ** 2 + (load[i, FY] - weight[i] * gravity) ** 2
        worst, broken = max(worst, square), broken + 0.0 * square
    if clumps is not None:
        for c in range(len(clumps.motion)):
            if clumps.start[c] < clumps.start[c + 1]:
                bodies += 1
                fx, fy, _ = resultant(c, clumps, disc, load, weight, gravity)
                square = fx * fx + fy * fy
                worst, broken = max(worst, square), broken + 0.0 * square
    total += broken + 0.0 * total
    return 0.0 if total == 0.0 else worst**0.5 * bodies / total
