"""Kernels of softening: strength of every zone from its plastic shear strain. A step without the table contains none of them.

A block without plastic shear strain uses the initial strength of its materials.
"""

from math import sqrt

from coupler_protocol.compiled.jit import jit
from fdm_server.effects import mohr_coulomb as mohr_coulomb_law
from fdm_server.effects import softening as law
from fdm_server.step.blocks import LANES
from fdm_server.step.strain import T0, T1, T2, T3
from fdm_server.step.stress import SHEARING, limit

between = jit(law.between, forceinline=True)
passive_ratio = jit(mohr_coulomb_law.passive_ratio)
directions = jit(mohr_coulomb_law.directions, forceinline=True)

CURVES = 4  # cohesion, friction, dilation, tension
COHESION, FRICTION, DILATION, OPENING = (k * LANES for k in range(CURVES))
SHEAR_ROWS, OPENING_ROWS = 10, 3  # parameters of Mohr-Coulomb and of the tension cut-off


@jit
def curve_values(table, strain, values, share):
    """Sets `values`, rows of the four curves of 16 zones, at their plastic shear strains; table: rows of softening."""
    points = table.shape[0] // ((CURVES + 1) * LANES)
    for k in range(points - 1):
        first, last = table[k * LANES : (k + 1) * LANES], table[(k + 1) * LANES : (k + 2) * LANES]
        for i in range(LANES):
            inside = (first[i] <= strain[i]) & (strain[i] < last[i])
            share[i] = (strain[i] - first[i]) / (last[i] - first[i]) if inside else -1.0
        for c in range(CURVES):
            row = ((c + 1) * points + k) * LANES
            before, after = table[row : row + LANES], table[row + LANES : row + 2 * LANES]
            value = values[c * LANES : (c + 1) * LANES]
            for i in range(LANES):
                value[i] = between(share[i], before[i], after[i]) if share[i] >= 0.0 else value[i]


@jit
def strengths(strain, stiffness, values, shear, opening):
    """Sets parameters, rows of `shear` and `opening`, of those of 16 zones with plastic shear strain, from their curve values."""
    for i in range(LANES):  # sines are not vectorised
        values[FRICTION + i] = passive_ratio(values[FRICTION + i])
        values[DILATION + i] = passive_ratio(values[DILATION + i])
    for i in range(LANES):
        flowed = strain[i] > 0.0
        N, Np = values[FRICTION + i], values[DILATION + i]
        C = 2.0 * values[COHESION + i] * sqrt(N)
        apex = C / (N - 1.0) if N > 1.0 else float("inf")
        least = min(values[OPENING + i], apex)
        a1, a2 = stiffness[i] + stiffness[LANES + i], stiffness[2 * LANES + i]
        p1, p2, p3, c1, c23, e12, e3 = directions(N, Np, a1, a2)
        shear[i] = N if flowed else shear[i]
        shear[LANES + i] = C if flowed else shear[LANES + i]
        shear[2 * LANES + i] = apex if flowed else shear[2 * LANES + i]
        shear[3 * LANES + i] = p1 if flowed else shear[3 * LANES + i]
        shear[4 * LANES + i] = p2 if flowed else shear[4 * LANES + i]
        shear[5 * LANES + i] = p3 if flowed else shear[5 * LANES + i]
        shear[6 * LANES + i] = c1 if flowed else shear[6 * LANES + i]
        shear[7 * LANES + i] = c23 if flowed else shear[7 * LANES + i]
        shear[8 * LANES + i] = e12 if flowed else shear[8 * LANES + i]
        shear[9 * LANES + i] = e3 if flowed else shear[9 * LANES + i]
        opening[i] = least if flowed else opening[i]


@jit
def limit_softened(
    b, m, share, elastic, mohr_coulomb, tension, softening, stress, plastic, plastic_shear, shear, opening, values, limited
):  # fmt: skip
    """`limit` with the strength of the present plastic shear strains; adds their increments.

    Scratch: shear (1, 10 rows), opening (1, 3 rows), values (5 rows).
    """
    strain, flowed = plastic_shear[b], 0
    for i in range(LANES):
        flowed += 1 if strain[i] > 0.0 else 0
    if flowed == 0:
        yields = limit(b, m, share, mohr_coulomb, tension, stress, plastic, limited, elastic)
    else:
        for k in range(SHEAR_ROWS * LANES):
            shear[0, k] = mohr_coulomb[m, k]
        if tension is not None:
            for k in range(OPENING_ROWS * LANES):
                opening[0, k] = tension[m, k]
        curve_values(softening[m], strain, values[: CURVES * LANES], values[CURVES * LANES :])
        strengths(strain, elastic[m], values, shear[0], opening[0])
        if tension is not None:
            yields = limit(b, 0, share, shear, opening, stress, plastic, limited, elastic[m : m + 1])
        else:
            yields = limit(b, 0, share, shear, None, stress, plastic, limited, elastic[m : m + 1])
    for i in range(LANES if yields else 0):
        flow = limited[SHEARING + T0 + i] + limited[SHEARING + T1 + i]
        strain[i] += flow + (limited[SHEARING + T2 + i] + limited[SHEARING + T3 + i])
