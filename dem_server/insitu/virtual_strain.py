"""Virtual strain, which brings a packing to a given stress field, and bonding of the packing.

The ring is held. On a coarse grid the missing stress is converted into a strain, which is applied to the
contacts, not to the discs:

    eps = 0.8 S : (sigma* - sigma)                                               (1)
    gr <- gr - d n.eps.n,    Fs <- Fs - ks d t.eps.n                             (2)

at every contact (d: distance of centres), as if the discs had been strained by eps and moved back. Then they
relax with friction and gravity, and the round is repeated. S is the compliance of an isotropic packing under
uniform strain (Bathurst & Rothenburg 1988, J. Appl. Mech. 55, 17-23):

    C11 + C12 = sum kn d^2 / 2A,    2 G = sum (kn + ks) d^2 / 4A                 (3)

A steep slope needs cohesion: its stress is outside the cone that friction alone can carry. So the first half
of the rounds brings the discs as close as friction allows, and in the second half the contacts are bonded,
round by round, so that the bonds carry a part of sigma*. In these rounds, stress outside the estimated strength of
the bonded packing (packing_strength.py) is reduced to this strength, and its share is reported.

If the discs then lack more than SHORT of the mobilised sine of the zones, further rounds find the strength that the
packing really has: sigma* is the stress of the zones itself, reduced only where a principal stress is in tension
beyond the bonds, and the deviator of eps is doubled: by (3), the stiffness in shear is that under uniform strain, about
twice that of discs that rearrange. Where the strength is reached, contacts slip or bonds break and are made again, and the
stress stays behind sigma*. The discs keep the State of the round with the stress nearest to that of the zones; PATIENCE
rounds without a nearer one end the search.
"""

import copy
from typing import NamedTuple

import numpy as np
import shapely

from coupler_protocol.geometry import polygon_area
from coupler_protocol.problems import unfit
from coupler_protocol.wire.payloads import FIELD
from dem_server.effects.bond import BONDED, NONE
from dem_server.insitu.contact_stress import circle_stress, contact_moments
from dem_server.insitu.hat_bins import bins_over
from dem_server.insitu.packing_strength import friction_sine, inside_cone, mixture_sine, tensile_strength
from dem_server.insitu.stone_stress import circle_stress_with_stones
from dem_server.insitu.zone_stress import imbalance, stress_field
from dem_server.model import SHEAR_BREAKS, SPIN, TENSION_BREAKS, VX, outline
from dem_server.observe.coordination import coordination, porosity
from dem_server.observe.unbalanced_ratio import unbalanced_ratio
from dem_server.pairs import contacts
from dem_server.step.bonds_made import add_bonds
from dem_server.step.contact_pass import contact_forces
from dem_server.step.cycle import advance

ROUNDS = 12
STEPS = 300  # of relaxation a round
RELAXATION = 0.8  # of the missing stress corrected a round, Eq (1)
SHORT = 0.05  # share of the mobilised sine of the zones; if the discs lack more, further rounds follow
FURTHER = 12  # of them at most
PATIENCE = 3  # of them that bring the discs no nearer end the search
SHEARED = 2.0  # factor of the deviator in them
REST = 1e-6  # unbalanced ratio at the end
BIN = 8.0  # size of a bin and smallest radius of a measuring circle, in mean radii
CIRCLE = 0.25  # radius of the measuring circles [m]; larger if too few discs fit into such a circle


class Aim(NamedTuple):
    """Target of the discs: measuring circles, and in each circle the stress that the packing could carry.

    centres (q, 2), radius [m]; stress (q, 3) xx, yy, xy [Pa]; zones (q, 3): stress of the zones, of which `stress` is the part
    within the estimated strength of the packing; after further rounds, `stress` is `zones`.
    """

    centres: np.ndarray
    radius: float
    stress: np.ndarray
    zones: np.ndarray


class Report(NamedTuple):
    """Result of `bring_to_stress`.

    Errors of the stress (rms over measuring circles, over mean |yy|); shares of the zones' stress beyond the packing's estimated
    strength and beyond that of friction alone; sum of the target's force on the window and the window's weight, over
    the weight; rounds, those among them that aimed at the zones' own stress, unbalanced ratio, coordination number, porosity.
    """

    error_xx: float
    error_yy: float
    error_xy: float
    projected: float
    beyond_friction: float
    imbalance_x: float
    imbalance_y: float
    rounds: int
    further_rounds: int
    ratio: float
    coordination: float
    porosity: float


def match_weight(model, state, target):
    """Scales the weight of the soil, with the ring's inner shares, so that the discs weigh as much as the zones.

    Stones keep their weight. Returns the factor.
    """
    soil = np.ones(model.count, dtype=bool) if state.stone is None else state.stone < 0
    wanted = float(target[:, FIELD.area] @ target[:, FIELD.density]) - float(state.weight[~soil].sum())
    if wanted <= 0.0:
        reason = "the stones alone weigh more than the zones they replace"
        raise unfit("discs.stone.density", reason, "choose a lower density, or density_matching = false")
    factor = wanted / float(state.weight[soil].sum())
    state.weight[soil] *= factor
    return factor


def bring_to_stress(model, state, target, gravity, report=None):
    """Brings the discs to the stress of the removed zones under `gravity` [m/s2], and bonds most of them in the later rounds.

    target (z, 7): x, y, area, xx, yy, xy, density of the zones (tension positive); report(text, fraction): called with
    the progress, or None. Raises SceneError for zones without any vertical stress.
    """
    if not target[:, FIELD.yy].any():
        reason = "the zones of the window carry no stress that their discs could be brought to"
        raise unfit("stage", reason, "insitu = false in the stage of kind fill, or gravity in a stage before it")
    polygon = outline(model, state)
    size = BIN * float(state.radius[model.ring :].mean())
    grid, aim = bins_over(polygon, size), aim_of(model, state, target)
    field, sine, tension = stress_field(target), friction_sine(model), tensile_strength(model, state)
    wanted, projected = inside_cone(field(grid.points), mixture_sine(model, state), tension)
    held_by_friction, beyond_friction = inside_cone(wanted, sine)
    left_over = imbalance(polygon, field, gravity * float(state.weight.sum()))
    for round_ in range(ROUNDS):
        if tension > 0.0 and round_ >= ROUNDS // 2:
            add_bonds(model, state)
            goal = grid.integral(wanted)
        else:
            goal = grid.integral(held_by_friction)
        strain_contacts(model, state, grid, goal)
        relax(model, state, gravity, STEPS)
        if report:
            report(f"in-situ stress, round {round_ + 1} of {ROUNDS}", (round_ + 1) / ROUNDS)
    further = 0
    if (sine > 0.0 or tension > 0.0) and lost_sine(state, aim) > SHORT:
        goal = grid.integral(inside_cone(field(grid.points), 1.0, tension)[0])
        further = bring_nearer(model, state, aim, grid, goal, gravity, report)
        aim = final_aim(aim, further)
    come_to_rest(model, state, gravity, report)
    reset_broken_bonds(state)
    return Report(
        *stress_error(state, aim).tolist(),
        projected=projected,
        beyond_friction=beyond_friction,
        imbalance_x=float(left_over[0]),
        imbalance_y=float(left_over[1]),
        rounds=ROUNDS + further,
        further_rounds=further,
        ratio=unbalanced_ratio(model, state, gravity),
        coordination=coordination(model, state)[0],
        porosity=porosity(model, state),
    )


def bring_nearer(model, state, aim, grid, goal, gravity, report=None):
    """Takes further rounds, with bonds if the contacts have them, and keeps those up to the nearest to the zones' stress.

    aim: an Aim; grid, goal: as in `strain_contacts`. Returns the number of rounds that were kept.
    """
    nearest, kept, before = distance_from_zones(state, aim), 0, copy.deepcopy(vars(state))
    for round_ in range(1, FURTHER + 1):
        if model.law.bond is not None:
            add_bonds(model, state)
        strain_contacts(model, state, grid, goal, SHEARED)
        relax(model, state, gravity, STEPS)
        if report:
            report(f"in-situ stress, further round {round_} of at most {FURTHER}")
        distance = distance_from_zones(state, aim)
        if distance < nearest:
            nearest, kept, before = distance, round_, copy.deepcopy(vars(state))
        if round_ - kept >= PATIENCE or lost_sine(state, aim) <= 0.0:
            break
    if kept < round_:
        vars(state).update(before)
    return kept


def distance_from_zones(state, aim):
    """Root mean square [Pa] over the circles of an Aim of the difference of the discs' stress tensor from that of the zones."""
    return float(np.sqrt(((stress_in_circles(state, aim) - aim.zones) ** 2 @ [1.0, 1.0, 2.0]).mean()))


def lost_sine(state, aim):
    """Share of the mobilised sine of the zones that the discs lack; 0 for zones without compression or shear."""
    zones = mobilised_sine(aim.zones)
    return 1.0 - mobilised_sine(stress_in_circles(state, aim)) / zones if zones > 0.0 else 0.0


def final_aim(aim, further_rounds):
    """The Aim of the last rounds: with further rounds, the stress of the zones itself."""
    return aim._replace(stress=aim.zones) if further_rounds else aim


def aim_of(model, state, target):
    """Aim of a window that replaces the zones `target` (z, 7); `state`: its packing before `bring_to_stress`."""
    polygon = outline(model, state)
    size = BIN * float(state.radius[model.ring :].mean())
    centres, radius = measuring_circles(polygon, max(CIRCLE, size))
    wanted = stress_field(target)(centres)
    return Aim(centres, radius, inside_cone(wanted, mixture_sine(model, state), tensile_strength(model, state))[0], wanted)


def come_to_rest(model, state, gravity, report=None):
    """Relaxes until the discs are at rest, or for 20 rounds; report(text): called with the unbalanced ratio."""
    for _ in range(20):
        ratio = unbalanced_ratio(model, state, gravity)
        if ratio <= REST:
            break
        if report:
            report(f"discs come to rest, ratio {ratio:.1e} of {REST:.1e}")
        relax(model, state, gravity, STEPS)


def relax(model, state, gravity, steps):
    """Takes `steps` steps with the ring held."""
    advance(model, state, gravity, steps)


def strain_contacts(model, state, grid, goal, sheared=1.0):
    """Applies Eqs (1) to (3) and sets the velocities to zero.

    goal (nodes, 3): integral of sigma* over each bin; sheared: factor of the deviator of eps.
    """
    pairs = contacts(state)
    area = grid.area()
    area = np.maximum(area, 0.25 * area.max())  # bins cut by the edge have too few contacts for a smaller area
    hats = grid.weights(state.x[pairs.disc_a] + 0.5 * pairs.branch)
    missing = RELAXATION * (goal - hats.T @ contact_moments(pairs)) / area[:, None]
    d = np.hypot(*pairs.branch.T)
    kn, ks = model.law.spring.normal[pairs.kind], model.law.spring.shear[pairs.kind]
    total = polygon_area(outline(model, state))
    bulk, twice_shear = kn @ d**2 / (2.0 * total), (kn + ks) @ d**2 / (4.0 * total * sheared)
    trace, half = missing[:, 0] + missing[:, 1], 0.5 * (missing[:, 0] - missing[:, 1])
    mean, deviator = 0.5 * trace / bulk, half / twice_shear
    strain = np.column_stack([mean + deviator, mean - deviator, missing[:, 2] / twice_shear])
    xx, yy, xy = (hats @ strain).T
    nx, ny = pairs.normal.T
    state.reference_gap[pairs.slot] -= d * (xx * nx * nx + yy * ny * ny + 2.0 * xy * nx * ny)
    if state.shear is not None:
        state.shear[pairs.slot] -= ks * d * ((yy - xx) * nx * ny + xy * (nx * nx - ny * ny))
    state.disc[:, VX : SPIN + 1] = 0.0
    contact_forces(model, state)


def measuring_circles(polygon, radius):
    """Centres (q, 2) of circles inside the polygon, and their radius: `radius` if the polygon is wide enough.

    They are on a square grid and at the centre of the largest inscribed circle.
    """
    outline = shapely.Polygon(polygon)
    widest = shapely.maximum_inscribed_circle(outline, tolerance=1e-3)  # a line from its centre to its edge
    radius = min(radius, 0.99 * widest.length)
    x0, y0, x1, y1 = outline.bounds
    grid = np.stack(np.meshgrid(np.arange(x0, x1, radius), np.arange(y0, y1, radius)), axis=-1).reshape(-1, 2)
    inside = shapely.intersects_xy(outline.buffer(-radius), grid)
    return np.vstack([widest.coords[0], grid[inside]]), radius


def stress_error(state, aim, outlines=None):
    """Root mean square over the circles of an Aim of stress - aimed stress, over the mean of its |yy|: xx, yy, xy (3,).

    outlines: polygons of the clumps, where there are any.
    """
    return _deviation(stress_in_circles(state, aim, outlines), aim.stress)


def _deviation(found, wanted):
    """Root mean square of found - wanted (q, 3), over the mean of |yy| of `wanted`."""
    return np.sqrt(((found - wanted) ** 2).mean(axis=0)) / np.abs(wanted[:, 1]).mean()


def stress_in_circles(state, aim, outlines=None):
    """Stress (q, 3) xx, yy, xy [Pa] of the discs in the circles of an Aim; outlines: polygons of the clumps, if there are any."""
    if state.clumps is not None:
        return circle_stress_with_stones(state, outlines, aim.centres, aim.radius)
    pairs = contacts(state)
    return circle_stress(state.x[pairs.disc_a], pairs, aim.centres, aim.radius)


def against_zones(state, aim, outlines=None):
    """Entries of run.json that compare the discs with the zones, whatever the packing could carry.

    zones_xx, zones_yy, zones_xy: as `stress_error`, but of the zones' own stress; sine_zones, sine_discs: mobilised sine
    (s1 - s3) / (s1 + s3) of both, sums over the circles.
    """
    found = stress_in_circles(state, aim, outlines)
    errors = _deviation(found, aim.zones).tolist()
    names = ("zones_xx", "zones_yy", "zones_xy")
    return dict(zip(names, errors, strict=True)) | {
        "sine_zones": mobilised_sine(aim.zones),
        "sine_discs": mobilised_sine(found),
    }


def mobilised_sine(stress):
    """(s1 - s3) / (s1 + s3) [-] of stresses (q, 3), each part summed over the q places; NaN without compression."""
    deviator = np.hypot(0.5 * (stress[:, 0] - stress[:, 1]), stress[:, 2]).sum()
    mean = -0.5 * (stress[:, 0] + stress[:, 1]).sum()
    return float(deviator / mean) if mean > 0.0 else float("nan")


def reset_broken_bonds(state):
    """Sets broken bonds to never bonded and their counts to zero: bonds that break in `bring_to_stress` are not damage."""
    if state.bond_state is not None:
        state.bond_state[state.bond_state != BONDED] = NONE
    state.counters[[TENSION_BREAKS, SHEAR_BREAKS]] = 0
    state.breaks = None
