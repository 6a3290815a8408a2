"""Filling a window: discs spread evenly or placed from the ring inward, grown to the confining stress.

packing = "relaxed":
1. Points of the R2 sequence (additive recurrence of the plastic number, Roberts 2018) inside the window, as
   many discs as the porosity asks for, radii uniform in radius (1 -+ spread); they start 2 % smaller.
2. Relaxation without friction in the static mode; velocities are set to zero a few times, so that the first
   overlaps cannot throw discs about.
packing = "inward": instead of 1 and 2 discs are placed one by one, each in touch with two, as many as there
is room for (inward.py).

Both:
3. Servo: every 200 steps, while the mean stress is not the wanted one, all radii change by what an affine
   deformation would need,

       dr/r = 2 A dp / sum(kn d^2)                                               (1)

   (A: area, dp: missing mean stress, d: distance of centres), and while stress is missing discs with fewer
   than three contacts grow by 1 %, so that few stay loose. It ends when the discs are calm at that stress.
The ring stays where it is and the discs take its shape; there is no gravity.
"""

from typing import NamedTuple

import numpy as np
import shapely

from coupler_protocol.interface import polygon_area
from coupler_protocol.problems import unfit
from dem_server import inward
from dem_server.contacts import contact_forces
from dem_server.effects import RING, SOIL, Law
from dem_server.effects.damping import DampingTable
from dem_server.effects.pairs import Pair
from dem_server.effects.spring import SpringTable, spring_table
from dem_server.fields import contacts
from dem_server.model import RADIUS, Model, new_state
from dem_server.motion import move_free
from dem_server.neighbours import rebuild
from dem_server.ring import inner_share

PLASTIC = 1.32471795724474602596  # real root of x^3 = x + 1
STEPS = 200  # between two growths
ROUNDS = 100  # growths at most
LARGEST = 0.01  # growth of a radius in one go
START = 0.98  # of its radius is every disc's size at first: they grow into contact
ACCURACY = 0.01  # of the confining stress
CALM = 5e-4  # mean resultant over mean force at the end; friction, switched on later, holds what still creeps


class Packing(NamedTuple):
    """Free discs: centres `xy` (n, 2), `radius` (n,) [m], sorted in space."""

    xy: np.ndarray
    radius: np.ndarray


def pack(polygon, ring_xy, ring_radius, discs, rng, report=None):
    """Packing of a window in its ring at the stress `discs.confinement`.

    polygon (P, 2) counter-clockwise; ring_xy (R, 2), ring_radius (R,); discs: the scene's table; rng: numpy
    Generator; report(text, fraction): progress, if wanted.
    """
    area, relaxed = polygon_area(polygon), discs.packing == "relaxed"
    solid_ring = np.pi * ring_radius**2 @ inner_share(ring_xy)
    radius = draw_radii(area * (1.0 - discs.porosity) - solid_ring if relaxed else area, discs, rng)
    inset = shapely.Polygon(polygon).buffer(-(ring_radius.max() + discs.radius * (1.0 - discs.spread)))
    if inset.is_empty or len(radius) < 1:
        raise unfit("discs.radius", f"no disc of radius {discs.radius:g} m fits into the window", "choose a smaller radius")
    if relaxed:
        xy, radius = spread_points(inset, len(radius), rng), START * radius
    else:
        xy, radius = inward.fill(polygon, ring_xy, ring_radius, START * radius)
    order = in_strips(xy, 4.0 * discs.radius)
    model, state = smooth_discs(ring_xy, ring_radius, xy[order], radius[order], discs)
    if relaxed:
        settle(model, state, report)
    contact_forces(model, state)
    press(model, state, area, discs.confinement, report)
    escaped = ~shapely.contains_xy(shapely.Polygon(polygon), state.x[model.ring :])
    if escaped.any():
        raise ArithmeticError(f"{escaped.sum()} discs left the ring while packing: porosity too small?")
    return Packing(state.x[model.ring :].copy(), state.radius[model.ring :].copy())


def draw_radii(area, discs, rng):
    """Radii, uniform in radius (1 -+ spread), whose discs have `area` in all [m2]."""
    mean = np.pi * discs.radius**2 * (1.0 + discs.spread**2 / 3.0)
    number = max(round(area / mean), 0)
    return rng.uniform(discs.radius * (1.0 - discs.spread), discs.radius * (1.0 + discs.spread), number)


def spread_points(region, number, rng):
    """The first `number` points of a randomly shifted R2 sequence that fall into `region` (number, 2)."""
    x0, y0, x1, y1 = region.bounds
    shift = rng.random(2)
    tries = 2 * number + 100
    while True:
        unit = (shift + np.outer(np.arange(1, tries + 1), [1.0 / PLASTIC, 1.0 / PLASTIC**2])) % 1.0
        points = [x0, y0] + unit * [x1 - x0, y1 - y0]
        points = points[shapely.contains_xy(region, points)]
        if len(points) >= number:
            return points[:number]
        tries *= 2


def in_strips(xy, width):
    """Order that runs along strips of `width` across the longer side: near discs get near numbers."""
    low, size = xy.min(axis=0), np.ptp(xy, axis=0)
    long, short = (0, 1) if size[0] > size[1] else (1, 0)
    strip = ((xy[:, long] - low[long]) / width).astype(np.int64)
    return np.lexsort((xy[:, short], strip))


def smooth_discs(ring_xy, ring_radius, xy, radius, discs):
    """Model and State without friction and bonds, all springs as between two discs of soil."""
    spring = spring_table([Pair(discs.soil, discs.soil)] * 4, discs.stiffness)
    law = Law(SpringTable(spring.normal, 0.0 * spring.shear), damping=DampingTable(0.7))
    material = np.repeat(np.array([RING, SOIL], dtype=np.int32), (len(ring_xy), len(xy)))
    density = np.full(len(material), discs.soil.density)
    smallest = float(min(ring_radius.min(), discs.radius * (1.0 - discs.spread)))
    model = Model(law, len(ring_xy), material, density, smallest)
    return model, new_state(
        model, np.concatenate([ring_xy, xy]), np.concatenate([ring_radius, radius]), reference_gap=False
    )


def run(model, state, steps):
    """`steps` steps without gravity."""
    for _ in range(steps):
        move_free(model, state, 0.0)
        contact_forces(model, state)


def settle(model, state, report):
    """From random overlaps to rest."""
    contact_forces(model, state)
    for _ in range(8):
        run(model, state, 50)
        state.v[:] = 0.0
    if report:
        report("discs spread", 0.2)
    run(model, state, 1100)
    if report:
        report("discs at rest", 0.4)


def press(model, state, area, target, report):
    """Change radii, Eq (1), until the discs are calm at the mean stress `target` [Pa]."""
    for round_ in range(ROUNDS):
        pairs = contacts(state)
        length = np.hypot(*pairs.branch.T)
        stress = pairs.normal_force @ length / (2.0 * area)
        if report:
            report(f"mean stress {stress / 1e3:.1f} of {target / 1e3:.1f} kPa", 0.4 + 0.6 * round_ / ROUNDS)
        if abs(target - stress) > ACCURACY * target:
            stiffness = model.law.spring.normal[pairs.kind] @ length**2
            growth = 2.0 * area * (target - stress) / stiffness if len(length) else LARGEST
            grow(model, state, pairs, np.clip(growth, -LARGEST, LARGEST))
        elif unrest(model, state, pairs) < CALM:
            return
        run(model, state, STEPS)
    raise ArithmeticError(
        f"the packing is at {stress:.0f} Pa instead of {target:.0f} Pa after {ROUNDS} growths: "
        "a higher discs.confinement or more discs are easier to bring to rest"
    )


def unrest(model, state, pairs):
    """Mean resultant over mean sum of forces on the free discs [-]; a few loose ones do not rule it."""
    resultant = np.hypot(*state.force[model.ring :].T).sum()
    return resultant / (2.0 * pairs.normal_force.sum())


def grow(model, state, pairs, growth):
    """Change the radii of the free discs by the share `growth`; if it is positive loose discs grow more."""
    free = np.arange(model.count) >= model.ring
    state.disc[free, RADIUS] *= 1.0 + growth
    if growth > 0.0:
        number = np.bincount(np.concatenate([pairs.disc_a, pairs.disc_b]), minlength=model.count)
        state.disc[free & (number < 3), RADIUS] *= 1.0 + LARGEST
    rebuild(model, state)
    contact_forces(model, state)
