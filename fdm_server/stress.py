"""Stresses of zones: elastic trial stress, return to where the law allows, and the zone's mean of what triangles do to pressure.

Mixed discretisation (Marti & Cundall 1982): sm = (xx + yy)/2 and zz answer to the dilation, which a zone has only one of, so they belong
to the zone; sd = (xx - yy)/2 and xy belong to each triangle. A triangle's principal stresses are sm -+ r in the plane, with
r = sqrt(sd^2 + xy^2), and zz across it; any of the three may be the middle one. Principal directions do not turn in a return. The
changes of sm and zz that the returns of the four triangles ask for are averaged by area: without that, dilatant flow diverges.
"""

from math import sqrt

from coupler_protocol.jit import jit
from fdm_server.blocks import LANES
from fdm_server.effects import elastic as elastic_law
from fdm_server.effects import mohr_coulomb as mohr_coulomb_law
from fdm_server.effects import tension as tension_law
from fdm_server.strain import DIFFERENCE, DILATION, GAMMA

SM, ZZ, SD, XY = (k * LANES for k in (0, 1, 2, 6))  # rows of a zone's stress; sd and xy have one a triangle
STRESS_ROWS = 10
SHEAR, TENSION = 1, 2  # plastic state now; the same two bits shifted by PAST: at an earlier step
PAST = 2
NOW = SHEAR | TENSION
SHEAR_FLOW, TENSION_FLOW = float(SHEAR), float(TENSION)
NEW_SD, NEW_XY, CHANGE_SM, CHANGE_ZZ, FLOW = (k * LANES for k in range(5))  # rows of a triangle's return
RETURN_ROWS = 5

pressure_increment = jit(elastic_law.pressure_increment)
shear_increment = jit(elastic_law.shear_increment)
plastic_return = jit(mohr_coulomb_law.plastic_return)
cut_off = jit(tension_law.cut_off)


@jit
def load(b, elastic, strain, stress):
    """Add the elastic stress of the strain increments of block b."""
    for i in range(LANES):
        sm, zz = pressure_increment(strain[DILATION + i], elastic[b, i], elastic[b, 2 * LANES + i])
        stress[b, SM + i] += sm
        stress[b, ZZ + i] += zz
    for t in range(4):
        o = t * LANES
        for i in range(LANES):
            sd, xy = shear_increment(strain[DIFFERENCE + o + i], strain[GAMMA + o + i], elastic[b, LANES + i])
            stress[b, SD + o + i] += sd
            stress[b, XY + o + i] += xy


@jit
def limit_triangle(b, t, share, mohr_coulomb, tension, stress, limited):
    """Return of triangle t in the zones of block b: rows of `limited` from t * RETURN_ROWS on."""
    o, out = t * LANES, t * RETURN_ROWS * LANES
    for i in range(LANES):
        sm, zz, sd, xy = stress[b, SM + i], stress[b, ZZ + i], stress[b, SD + o + i], stress[b, XY + o + i]
        r = sqrt(sd * sd + xy * xy)
        low, high = sm - r, sm + r
        below, above = zz < low, zz > high
        s1 = zz if below else low
        s2 = low if below else (high if above else zz)
        s3 = zz if above else high

        flow = 0.0
        if mohr_coulomb is not None:
            s1, s2, s3, sheared = plastic_return(
                *(s1, s2, s3),
                mohr_coulomb[b, i],
                mohr_coulomb[b, LANES + i],
                mohr_coulomb[b, 2 * LANES + i],
                mohr_coulomb[b, 3 * LANES + i],
                mohr_coulomb[b, 4 * LANES + i],
                mohr_coulomb[b, 5 * LANES + i],
                mohr_coulomb[b, 6 * LANES + i],
                mohr_coulomb[b, 7 * LANES + i],
                mohr_coulomb[b, 8 * LANES + i],
                mohr_coulomb[b, 9 * LANES + i],
            )
            flow += SHEAR_FLOW if sheared else 0.0
        if tension is not None:
            s1, s2, s3, opened = cut_off(
                *(s1, s2, s3), tension[b, i], tension[b, LANES + i], tension[b, 2 * LANES + i]
            )
            flow += TENSION_FLOW if opened else 0.0

        yields = flow > 0.0
        low = s2 if below else s1
        high = s2 if above else s3
        across = s1 if below else (s3 if above else s2)
        turn = 0.5 * (high - low) / (r if r > 0.0 else 1.0)
        weight = 0.5 * share[b, o + i]
        limited[out + NEW_SD + i] = turn * sd if yields else sd
        limited[out + NEW_XY + i] = turn * xy if yields else xy
        limited[out + CHANGE_SM + i] = weight * (0.5 * (low + high) - sm) if yields else 0.0
        limited[out + CHANGE_ZZ + i] = weight * (across - zz) if yields else 0.0
        limited[out + FLOW + i] = flow if weight > 0.0 else 0.0


@jit
def limit(b, share, mohr_coulomb, tension, stress, plastic, limited):
    """Bring the stresses of block b back to where the law allows them and update the zones' plastic state."""
    limit_triangle(b, 0, share, mohr_coulomb, tension, stress, limited)
    limit_triangle(b, 1, share, mohr_coulomb, tension, stress, limited)
    limit_triangle(b, 2, share, mohr_coulomb, tension, stress, limited)
    limit_triangle(b, 3, share, mohr_coulomb, tension, stress, limited)
    for t in range(4):
        o, out = t * LANES, t * RETURN_ROWS * LANES
        for i in range(LANES):
            stress[b, SM + i] += limited[out + CHANGE_SM + i]
            stress[b, ZZ + i] += limited[out + CHANGE_ZZ + i]
            stress[b, SD + o + i] = limited[out + NEW_SD + i]
            stress[b, XY + o + i] = limited[out + NEW_XY + i]
    for i in range(LANES):
        now = 0
        for t in range(4):
            now |= int(limited[t * RETURN_ROWS * LANES + FLOW + i])
        before = plastic[b, i]
        plastic[b, i] = now | ((before & NOW) << PAST) | (before & (NOW << PAST))
