"""Stresses of zones: elastic trial stress, then the return to the yield surface.

Mixed discretisation (Marti & Cundall 1982): sm = (xx + yy)/2 and zz follow from the dilation, which is one value
for a zone, so they belong to the zone; sd = (xx - yy)/2 and xy belong to each triangle. The principal stresses of
a triangle are sm ± r in the plane, with r = sqrt(sd^2 + xy^2), and zz normal to it; any of the three may be the
intermediate one. Principal directions do not rotate in a return. The changes of sm and zz by the returns of the
four triangles are averaged by area: without this, dilatant flow diverges.

Rayleigh damping adds the rate of stress in a step to the stress that makes forces: `copy_stress` before, `add_rate` after.
"""

from math import sqrt

from coupler_protocol.compiled.jit import jit
from fdm_server.effects import elastic as elastic_law
from fdm_server.effects import mohr_coulomb as mohr_coulomb_law
from fdm_server.effects import softening as softening_law
from fdm_server.effects import tension as tension_law
from fdm_server.effects.plastic_state import NOW, PAST
from fdm_server.step.blocks import LANES
from fdm_server.step.strain import DIFFERENCE, DILATION, GAMMA, T0, T1, T2, T3

# rows of stress: sm and zz of the zone, then sd and xy of its four triangles
SM, ZZ, SD, XY = (k * LANES for k in (0, 1, 2, 6))
STRESS_ROWS = 10
# rows of the changes by returns, four triangles each
NEW_SD, NEW_XY, CHANGE_SM, CHANGE_ZZ, FLOW = (4 * k * LANES for k in range(5))
RETURN_ROWS = 20
SHEARING = RETURN_ROWS * LANES  # with softening four more: plastic shear strain, share of the zone's

pressure_increment = jit(elastic_law.pressure_increment, forceinline=True)
shear_increment = jit(elastic_law.shear_increment, forceinline=True)
plastic_return = jit(mohr_coulomb_law.plastic_return, forceinline=True)
cut_off = jit(tension_law.cut_off, forceinline=True)
shear_strain = jit(softening_law.shear_strain, forceinline=True)


@jit
def load(b, m, elastic, strain, stress):
    """Adds the elastic stress of the strain increments of block b, whose parameters are in row m."""
    for i in range(LANES):
        sm, zz = pressure_increment(strain[DILATION + i], elastic[m, i], elastic[m, 2 * LANES + i])
        stress[b, SM + i] += sm
        stress[b, ZZ + i] += zz
        for o in (T0, T1, T2, T3):
            sd, xy = shear_increment(strain[DIFFERENCE + o + i], strain[GAMMA + o + i], elastic[m, LANES + i])
            stress[b, SD + o + i] += sd
            stress[b, XY + o + i] += xy


@jit(forceinline=True)
def trial(b, k, i, stress):
    """sm, zz, sd, xy [Pa] of the triangle with index k in zone i of block b, and r, the radius of its circle of stress."""
    sd, xy = stress[b, SD + k], stress[b, XY + k]
    return stress[b, SM + i], stress[b, ZZ + i], sd, xy, sqrt(sd * sd + xy * xy)


@jit
def return_triangles(b, m, share, mohr_coulomb, tension, stress, limited, softens):
    """Corrects the trial stresses of block b to the yield surface; writes the results to the rows of `limited`.

    softens: elastic parameters if plastic shear strain is needed, or None.
    """
    for t in range(4):
        o = t * LANES
        for i in range(LANES):
            sm, zz, sd, xy, r = trial(b, o + i, i, stress)
            low, high = sm - r, sm + r
            below, above = zz < low, zz > high
            s1 = zz if below else low
            s2 = low if below else (high if above else zz)
            s3 = zz if above else high

            flow = 0.0
            weight = 0.5 * share[b, o + i]
            if mohr_coulomb is not None:
                t1, t2, t3 = s1, s2, s3
                s1, s2, s3, sheared = plastic_return(
                    *(s1, s2, s3),
                    mohr_coulomb[m, i],
                    mohr_coulomb[m, LANES + i],
                    mohr_coulomb[m, 2 * LANES + i],
                    mohr_coulomb[m, 3 * LANES + i],
                    mohr_coulomb[m, 4 * LANES + i],
                    mohr_coulomb[m, 5 * LANES + i],
                    mohr_coulomb[m, 6 * LANES + i],
                    mohr_coulomb[m, 7 * LANES + i],
                    mohr_coulomb[m, 8 * LANES + i],
                    mohr_coulomb[m, 9 * LANES + i],
                )
                flow += 1.0 if sheared else 0.0
                if softens is not None:
                    strain = shear_strain(t1 - s1, t2 - s2, t3 - s3, softens[m, LANES + i])
                    limited[SHEARING + o + i] = weight * strain if sheared else 0.0
            if tension is not None:
                s1, s2, s3, opened = cut_off(*(s1, s2, s3), tension[m, i], tension[m, LANES + i], tension[m, 2 * LANES + i])
                flow += 2.0 if opened else 0.0

            yields = flow > 0.0
            low = s2 if below else s1
            high = s2 if above else s3
            across = s1 if below else (s3 if above else s2)
            turn = 0.5 * (high - low) / (r if r > 0.0 else 1.0)
            limited[NEW_SD + o + i] = turn * sd if yields else sd
            limited[NEW_XY + o + i] = turn * xy if yields else xy
            limited[CHANGE_SM + o + i] = weight * (0.5 * (low + high) - sm) if yields else 0.0
            limited[CHANGE_ZZ + o + i] = weight * (across - zz) if yields else 0.0
            limited[FLOW + o + i] = flow if weight > 0.0 else 0.0


@jit
def beyond_law(b, m, mohr_coulomb, tension, stress):
    """Whether any triangle of block b has a trial stress outside the yield surface."""
    beyond = 0
    for t in range(4):
        o = t * LANES
        for i in range(LANES):
            sm, zz, _, _, r = trial(b, o + i, i, stress)
            low, high = sm - r, sm + r
            s1 = zz if zz < low else low
            s3 = zz if zz > high else high
            if mohr_coulomb is not None:
                f = s1 - mohr_coulomb[m, i] * s3 + mohr_coulomb[m, LANES + i]
                beyond += 1 if f < 0.0 else 0
            if tension is not None:
                f = tension[m, i] - s3
                beyond += 1 if f < 0.0 else 0
    return beyond > 0


@jit
def limit(b, m, share, mohr_coulomb, tension, stress, plastic, limited, softens):
    """Corrects the stresses of block b to the yield surface, and the plastic state; returns whether any zone yields."""
    if not beyond_law(b, m, mohr_coulomb, tension, stress):
        for i in range(LANES):
            before = plastic[b, i]
            plastic[b, i] = ((before & NOW) << PAST) | (before & (NOW << PAST))
        return False
    return_triangles(b, m, share, mohr_coulomb, tension, stress, limited, softens)
    for i in range(LANES):
        for o in (T0, T1, T2, T3):
            stress[b, SM + i] += limited[CHANGE_SM + o + i]
            stress[b, ZZ + i] += limited[CHANGE_ZZ + o + i]
            stress[b, SD + o + i] = limited[NEW_SD + o + i]
            stress[b, XY + o + i] = limited[NEW_XY + o + i]
    for i in range(LANES):
        now = int(limited[FLOW + T0 + i]) | int(limited[FLOW + T1 + i])
        now |= int(limited[FLOW + T2 + i]) | int(limited[FLOW + T3 + i])
        before = plastic[b, i]
        plastic[b, i] = now | ((before & NOW) << PAST) | (before & (NOW << PAST))
    return True


@jit
def copy_stress(b, stress, before):
    """Copies the stresses of block b to `before` (1, 10 rows)."""
    for k in range(STRESS_ROWS * LANES):
        before[0, k] = stress[b, k]


@jit
def add_rate(b, stress, viscosity, before):
    """Replaces the stresses before the step by those that make forces: stress + viscosity (stress - before)."""
    for k in range(STRESS_ROWS * LANES):
        before[0, k] = stress[b, k] + viscosity * (stress[b, k] - before[0, k])
