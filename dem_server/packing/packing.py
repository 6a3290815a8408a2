"""Packing of a window: discs distributed evenly or placed from the ring inward, grown to a stress or to a porosity.

packing = "relaxed":
1. Points of the R2 sequence (additive recurrence of the plastic number, Roberts 2018) inside the window, as
   many discs as the porosity needs, radii uniform in radius (1 ± spread) or of a grading; they start 2 % smaller.
2. Relaxation without friction in static mode; velocities are set to zero several times, so that the first
   overlaps cannot eject discs.
packing = "inward": instead of 1 and 2, discs are placed one by one, each in contact with two others, until
there is no room (front_filling.py).

Both:
3. Radii grow until the discs have the target stress or the target porosity (growth.py).
The ring is held, and there is no gravity.
"""

from typing import NamedTuple

import numpy as np
import shapely

from coupler_protocol.geometry import polygon_area
from coupler_protocol.interface.ring import inner_share
from coupler_protocol.problems import unfit
from coupler_protocol.scene.tables.grading import Grading, grading_of
from dem_server.effects import RING, SOIL, Law
from dem_server.effects.damping import DampingTable
from dem_server.effects.pairs import Pair
from dem_server.effects.spring import SpringTable, spring_table
from dem_server.model import Model, new_state
from dem_server.observe.coordination import porosity
from dem_server.packing import front_filling, growth
from dem_server.packing.growth import run
from dem_server.packing.radii import places, radii
from dem_server.pairs import contacts
from dem_server.step.contact_pass import contact_forces

PLASTIC = 1.32471795724474602596  # real root of x^3 = x + 1
RETURNS = 5  # largest number of times that squeezed-out discs are moved back into the window
START = 0.98  # initial radius of every disc as a share of its radius: discs grow into contact


class Packing(NamedTuple):
    """Free discs: centres `xy` (n, 2), `radius` (n,) [m], sorted in space.

    pressure [Pa], porosity: of the window, including the inner shares of its control discs; growth: of the radii since they
    were drawn; loose: the discs have no mutual support (only with a target porosity).
    """

    xy: np.ndarray
    radius: np.ndarray
    pressure: float = 0.0
    porosity: float = 0.0
    growth: float = 1.0
    loose: bool = False

    def report(self):
        """Numbers for the run's report."""
        numbers = {"packing_pressure": self.pressure, "packing_porosity": self.porosity, "packing_growth": self.growth}
        return numbers | ({"loose": True} if self.loose else {})


def pack(polygon, ring_xy, ring_radius, discs, rng, report=None):
    """Packing of a window in its ring, at the stress `discs.confinement` or at `discs.porosity` by `discs.target`.

    polygon (P, 2) counter-clockwise; ring_xy (R, 2), ring_radius (R,); discs: the scene's table; rng: numpy
    Generator; report(text, fraction): called with the progress, or None.
    """
    area, relaxed, grading = polygon_area(polygon), discs.packing == "relaxed", grading_of(discs)
    solid_ring = np.pi * ring_radius**2 @ inner_share(ring_xy)
    drawn = draw_radii(area * (1.0 - discs.porosity) - solid_ring if relaxed else area, grading, rng)
    inset = shapely.Polygon(polygon).buffer(-(ring_radius.max() + grading.smallest))
    if inset.is_empty or len(drawn) < 1:
        raise unfit("discs.radius", f"no disc of radius {discs.radius:g} m fits into the window", "choose a smaller radius")
    if relaxed:
        xy, radius = spread_points(inset, len(drawn), rng), START * drawn
        if isinstance(grading, Grading):
            radius = radius[places(xy, radius, inset, rng)]
    else:
        xy, radius = front_filling.fill(polygon, ring_xy, ring_radius, START * drawn)
    order = in_strips(xy, 4.0 * discs.radius)
    model, state = smooth_discs(ring_xy, ring_radius, xy[order], radius[order], discs)
    if relaxed:
        settle(model, state, report)
        return_discs(model, state, shapely.Polygon(polygon), inset)
    contact_forces(model, state)
    loose = False
    if getattr(discs, "target", "stress") == "porosity":
        loose = growth.to_porosity(model, state, area, discs.porosity, report)
    else:
        growth.to_stress(model, state, area, discs.confinement, report)
    escaped = ~shapely.contains_xy(shapely.Polygon(polygon), state.x[model.ring :])
    if escaped.any():
        raise ArithmeticError(f"{escaped.sum()} discs left the ring while packing: porosity too small?")
    xy, now = state.x[model.ring :].copy(), state.radius[model.ring :].copy()
    grown = float(np.sqrt((now**2).sum() / (radius**2).sum())) * START
    return Packing(xy, now, growth.pressure(contacts(state), area), porosity(model, state), grown, loose)


def draw_radii(area, grading, rng):
    """Radii, uniform or of a Grading, whose discs have `area` in all [m2]."""
    number = max(round(area / (0.25 * np.pi * grading.moment(2))), 0)
    if isinstance(grading, Grading):
        return radii(number, grading, rng)
    return rng.uniform(grading.smallest, grading.largest, number)


def spread_points(region, number, rng):
    """The first `number` points (number, 2) of a randomly shifted R2 sequence that are inside `region`."""
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
    """Order along strips of `width` [m] across the longer side: neighbouring discs get neighbouring numbers."""
    low, size = xy.min(axis=0), np.ptp(xy, axis=0)
    long, short = (0, 1) if size[0] > size[1] else (1, 0)
    strip = ((xy[:, long] - low[long]) / width).astype(np.int64)
    return np.lexsort((xy[:, short], strip))


def smooth_discs(ring_xy, ring_radius, xy, radius, discs):
    """Model and State without friction and bonds, with all springs as between two discs of soil."""
    spring = spring_table([Pair(discs.soil, discs.soil)] * 4, discs.stiffness)
    law = Law(SpringTable(spring.normal, 0.0 * spring.shear), damping=DampingTable(0.7))
    material = np.repeat(np.array([RING, SOIL], dtype=np.int32), (len(ring_xy), len(xy)))
    density = np.full(len(material), discs.soil.density)
    smallest = float(min(ring_radius.min(), grading_of(discs).smallest))
    model = Model(law, len(ring_xy), material, density, smallest)
    return model, new_state(model, np.concatenate([ring_xy, xy]), np.concatenate([ring_radius, radius]), reference_gap=False)


def return_discs(model, state, window, inset):
    """Moves discs that were squeezed out of the window (small ones beside much larger ones) to the nearest point inside."""
    for _ in range(RETURNS):
        out = model.ring + np.flatnonzero(~shapely.contains_xy(window, state.x[model.ring :]))
        if not len(out):
            return
        way = shapely.shortest_line(shapely.points(state.x[out]), inset)
        state.x[out] = shapely.get_coordinates(shapely.get_point(way, 1))
        settle(model, state, None)


def settle(model, state, report):
    """Relaxes discs from random overlaps to rest."""
    contact_forces(model, state)
    for round_ in range(8):
        if report:
            report("discs spread", 0.025 * round_)
        run(model, state, 50)
        state.v[:] = 0.0
    run(model, state, 1100, report and (lambda share: report("discs come to rest", 0.2 + 0.2 * share)))
