"""Kernels of softening: the strength of every zone from its plastic shear strain. None of it is in a step without the table."""

from math import radians, sqrt, tan

from coupler_protocol.jit import jit
from fdm_server.blocks import LANES
from fdm_server.effects import mohr_coulomb as mohr_coulomb_law
from fdm_server.effects import softening as law
from fdm_server.strain import T0, T1, T2, T3
from fdm_server.stress import SHEARING, limit

between = jit(law.between, forceinline=True)
passive_ratio = jit(mohr_coulomb_law.passive_ratio)
directions = jit(mohr_coulomb_law.directions)

STRENGTH_ROWS = 10 + 3  # parameters of Mohr-Coulomb, then of the tension cut-off
TENSION_ROW = 10 * LANES


@jit
def curve_value(softening, m, i, points, k, share, curve):
    """Value of a curve between its points k and k + 1, in lane i of row m."""
    row = (curve * points + k) * LANES + i
    return between(share, softening[m, row], softening[m, row + LANES])


@jit
def soften_lane(m, i, strain, softening, elastic, strength):
    """Parameters of lane i at plastic shear strain `strain`; row m holds its curves and stiffness."""
    points = softening.shape[1] // (5 * LANES)
    k = 0
    while softening[m, (k + 1) * LANES + i] <= strain:
        k += 1
    first, last = softening[m, k * LANES + i], softening[m, (k + 1) * LANES + i]
    share = (strain - first) / (last - first)
    cohesion = curve_value(softening, m, i, points, k, share, 1)
    friction = curve_value(softening, m, i, points, k, share, 2)
    dilation = curve_value(softening, m, i, points, k, share, 3)
    opening = curve_value(softening, m, i, points, k, share, 4)

    N, Np = passive_ratio(friction), passive_ratio(dilation)
    apex = cohesion / tan(radians(friction)) if friction > 0.0 else float("inf")
    strength[0, i] = N
    strength[0, LANES + i] = 2.0 * cohesion * sqrt(N)
    strength[0, 2 * LANES + i] = apex
    a1, a2 = elastic[m, i] + elastic[m, LANES + i], elastic[m, 2 * LANES + i]
    p1, p2, p3, c1, c23, e12, e3 = directions(N, Np, a1, a2)
    strength[0, 3 * LANES + i], strength[0, 4 * LANES + i], strength[0, 5 * LANES + i] = p1, p2, p3
    strength[0, 6 * LANES + i], strength[0, 7 * LANES + i] = c1, c23
    strength[0, 8 * LANES + i], strength[0, 9 * LANES + i] = e12, e3
    strength[0, TENSION_ROW + i] = min(opening, apex)


@jit
def limit_softened(
    b, m, share, elastic, mohr_coulomb, tension, softening, stress, plastic, plastic_shear, strength, limited
):  # fmt: skip
    """`limit` with the strength of the present plastic shear strains, which grow by what follows."""
    for k in range(TENSION_ROW):
        strength[0, k] = mohr_coulomb[m, k]
    if tension is not None:
        for k in range(3 * LANES):
            strength[0, TENSION_ROW + k] = tension[m, k]
    for i in range(LANES):
        if plastic_shear[b, i] > 0.0:
            soften_lane(m, i, plastic_shear[b, i], softening, elastic, strength)
    stiffness = elastic[m : m + 1]
    if tension is not None:
        yields = limit(b, 0, share, strength, strength[:, TENSION_ROW:], stress, plastic, limited, stiffness)
    else:
        yields = limit(b, 0, share, strength, None, stress, plastic, limited, stiffness)
    for i in range(LANES if yields else 0):
        flow = limited[SHEARING + T0 + i] + limited[SHEARING + T1 + i]
        plastic_shear[b, i] += flow + (limited[SHEARING + T2 + i] + limited[SHEARING + T3 + i])
