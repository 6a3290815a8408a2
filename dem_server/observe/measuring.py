"""Measures of the discs in the regions of a scene ([[measure]]), with their standard errors, for histories.

    stress       = -(1/A) sum w sym(F (x) l) + (1/A) sum virial of walls                     (1)
    porosity     = 1 - (1/A) (sum area of disc and region - sum overlaps of two discs)       (2)
    coordination = contacts of the bodies with their centroid inside over their number       (3)
    mechanical   = the same over the bodies with at least two contacts                       (4)
    sliding      = contacts inside with |Fs| = mu Fn over all contacts inside                (5)
    strain rate  = sym L,   sum r^2 |v - a - L x|^2 = min over the discs with centre inside  (6)

F: force on the second body of a contact, l: branch between the centroids of both bodies, w: exact share of l inside. Along the
branches the contact forces are in equilibrium at every centroid at rest, so (1) is exactly the mean stress that the cut branches
exert on the region's edge. A body is a disc or a clump. Contacts touch or are bonded; those with control discs and walls count in
(3). Velocities are those of the discs half a step before, in static stages in metres a step.

Standard errors say how much another packing of the same kind would differ. Those of (1) and (3) to (6) come from blocks of bodies
(coupler_protocol/measures/sampling_error.py), from the influence of each body on the mean. That of (2) is that of discs which the
edge of length P cuts at random,

    error = CUT sqrt(P D^3) / A,   D^3 = sum d^5 / sum d^2 over the discs of diameters d inside     (7)

because the solid area in a region of a dense packing varies as its edge, not as its area. CUT is from
scripts/studies/measuring_study.py.

Sources: (1) Weber (1966), Bull. Liaison Ponts et Chaussees 20, and Christoffersen, Mehrabadi & Nemat-Nasser (1981), J. Appl.
Mech. 48, 339-344; (4) Thornton (2000), Geotechnique 50, 43-53; (6) Itasca, PFC2D 3.1 Theory, "Measurement circles", and Bagi
(2006), Int. J. Solids Struct. 43, 3166-3184 (best-fit strain).
"""

from typing import Any, NamedTuple

import numpy as np
import shapely

from coupler_protocol.measures.regions import Region, solid_area
from coupler_protocol.measures.sampling_error import spreads_of_bodies
from coupler_protocol.problems import unfit
from dem_server.effects.bond import BONDED
from dem_server.observe import wall_forces
from dem_server.pairs import body_centres, exist, levers, listed_pairs, moments_along

CUT = 0.075  # of Eq (7)
LIMIT = 1.0 - 1e-9  # of the friction limit, from which on a contact slides
FEWEST = 3  # discs for a mean
STRESS, STRAIN_RATE = (tuple(f"{name}_{part}" for part in ("xx", "yy", "xy")) for name in ("stress", "strain_rate"))


class Measuring:
    """The regions of one window. `values` measures all of them."""

    def __init__(self, measures: Any, origin: Any) -> None:
        self.regions = {measure.name: Region(measure.region) for measure in measures}
        self.origin = origin

    @classmethod
    def of_window(cls, scene: Any, rank: int) -> "Measuring | None":
        """The regions of the window of `rank` in the local scene; None if it has none."""
        name = scene.window[rank - 1].name if scene.window else None
        chosen = [measure for measure in scene.measure if measure.window in (None, name)]
        return cls(chosen, scene.origin) if chosen else None

    def refuse_outside(self, rim: Any) -> None:
        """Raises SceneError for a region that reaches out of the window with its rim at nodes (K, 2) [m]."""
        window = shapely.Polygon(rim)
        edge = window.exterior
        for name, region in self.regions.items():
            if region.circle is not None:
                centre = shapely.Point(region.circle[:2])
                inside = window.covers(centre) and edge.distance(centre) >= region.circle[2] * (1.0 - 1e-9)
            else:
                inside = window.buffer(1e-9 * edge.length).covers(region.shape)
            if not inside:
                why = f"region {name!r} reaches out of its window, whose rim follows the sides of zones"
                raise unfit("measure", why, "make the region smaller or move it: colluvium check gives the size of the window")

    def refuse_empty(self, xy: Any) -> None:
        """Raises SceneError for a region with fewer than FEWEST centres of the discs at xy (n, 2) [m]."""
        for name, region in self.regions.items():
            inside = int(np.count_nonzero(region.contains(xy)))
            if inside < FEWEST:
                raise unfit(
                    "measure", f"region {name!r} contains {inside} discs", "move it to where discs are, or make it larger"
                )

    def values(self, model: Any, state: Any) -> dict[str, float]:
        """Histories {"quantity:region": value} of all regions."""
        found = {}
        for name, region in self.regions.items():
            found |= {f"{key}:{name}": value for key, value in measured(model, state, region).items()}
        return found


class Near(NamedTuple):
    """What a region needs of a State.

    pairs: contacts (m,) near the region or of bodies inside it, as dem_server.pairs.Contacts; body (n,): number of each disc's
    body; count: of numbers; centre (n, 2): centroid of the body of each disc [m]; inside (n,): whether that is inside.
    """

    pairs: Any
    body: np.ndarray
    count: int
    centre: np.ndarray
    inside: np.ndarray


def measured(model: Any, state: Any, region: Region) -> dict[str, float]:
    """All measures of a region and their errors, by name."""
    near, low_high = _near(state, region), region.bounds
    close = np.flatnonzero((np.abs(state.x - np.clip(state.x, *low_high)) <= state.radius[:, None]).all(axis=1))
    areas = np.zeros(len(state.x))
    areas[close] = region.areas(state.x[close], state.radius[close])
    means, influences = [], []
    for measure in (_stress, _coordination, _sliding, _strain_rate):
        values, parts = measure(model, state, region, near, areas)
        means.append(values)
        influences.append(parts)
    names = [name for values in means for name in values]
    found = {name: value for values in means for name, value in values.items()}
    errors = _errors(np.concatenate(influences), near, state) if np.any(areas) else np.full(len(names), np.nan)
    found |= {f"{name}_error": error for name, error in zip(names, errors.tolist(), strict=True)}
    found["porosity"] = 1.0 - solid_area(state.x[close], state.radius[close], areas[close], region) / region.area
    reached = 2.0 * state.radius[close][areas[close] > 0.0]
    size = float((reached**5).sum() / (reached**2).sum()) if len(reached) else np.nan
    found["porosity_error"] = float(CUT * np.sqrt(region.perimeter * size) / region.area)
    found["bodies"] = float(len(np.unique(near.body[near.inside])))
    return found


def _near(state: Any, region: Region) -> Near:
    """Contacts and bodies near a region."""
    count, clumps = len(state.x), state.clumps
    body = np.arange(count)
    if clumps is not None:
        body = np.where(clumps.body >= 0, count + clumps.body, body)
        count += len(clumps.motion)
    centre, (low, high) = body_centres(state), region.bounds
    lowest, highest = np.minimum(centre, state.x), np.maximum(centre, state.x)
    inside = region.contains(centre)
    a, b = state.first, state.second
    reaches = (np.minimum(lowest[a], lowest[b]) <= high) & (np.maximum(highest[a], highest[b]) >= low)
    pairs = listed_pairs(state, np.flatnonzero(reaches.all(axis=1) | inside[a] | inside[b]))
    there = exist(state, pairs)
    return Near(type(pairs)(*(array[there] for array in pairs)), body, count, centre, inside)


def _stress(model: Any, state: Any, region: Region, near: Near, areas: np.ndarray) -> Any:
    """Eq (1); a body answers for half the moments of its contacts less its share of the solid area of the mean."""
    pairs = near.pairs
    moments = moments_along(pairs.force, pairs.span) * region.shares(near.centre[pairs.disc_a], pairs.span)[:, None]
    of_body = _to_both(near, 0.5 * moments)
    if state.walls is not None:
        touching = np.flatnonzero((state.walls.normal > 0.0).any(axis=1) & region.contains(state.x))
        if len(touching):
            virial = wall_forces.on_discs(state)[1][touching][:, [0, 1, 3]]
            of_body += _sums(near.body[touching], virial, near.count)
    solid = float(areas.sum())
    if solid == 0.0:
        return dict.fromkeys(STRESS, np.nan), np.zeros((3, near.count))
    mean = of_body.sum(axis=0) / region.area
    share = np.bincount(near.body, areas, near.count) / solid
    return dict(zip(STRESS, mean.tolist(), strict=True)), (of_body / region.area - share[:, None] * mean).T


def _coordination(model: Any, state: Any, region: Region, near: Near, areas: np.ndarray) -> Any:
    """Eqs (3) and (4)."""
    pairs = near.pairs
    number = _to_both(near, np.ones((len(pairs.disc_a), 1)))[:, 0]
    if state.walls is not None:
        number += np.bincount(near.body, (state.walls.normal > 0.0).sum(axis=1), near.count)
    inside = np.zeros(near.count, dtype=bool)
    inside[near.body[near.inside]] = True
    rows = [_mean_of(number, inside), _mean_of(number, inside & (number >= 2.0))]
    names = ("coordination", "mechanical_coordination")
    return {name: mean for name, (mean, _) in zip(names, rows, strict=True)}, np.stack([parts for _, parts in rows])


def _sliding(model: Any, state: Any, region: Region, near: Near, areas: np.ndarray) -> Any:
    """Eq (5), of springs: a bonded contact does not slide. Nothing without friction."""
    if model.law.friction is None:
        return {}, np.zeros((0, near.count))
    pairs = near.pairs
    lever, _ = levers(state, pairs)
    place = state.x[pairs.disc_a] + pairs.branch * (lever / np.hypot(*pairs.branch.T))[:, None]
    normal, shear = state.normal[pairs.slot], np.abs(state.shear[pairs.slot])
    held = pairs.bond_state == BONDED
    if state.parallel is not None:
        held |= state.parallel.state[pairs.slot] == BONDED
    slides = ~held & (normal > 0.0) & (shear >= LIMIT * model.law.friction.coefficient[pairs.kind] * normal)
    inside = region.contains(place)
    mean, parts = _mean_of(1.0 * slides, inside)
    return {"sliding": mean}, _to_both(near, 0.5 * parts[:, None]).T


def _strain_rate(model: Any, state: Any, region: Region, near: Near, areas: np.ndarray) -> Any:
    """Eq (6); a disc answers for its residual velocity, a clump for those of its discs."""
    inside = np.flatnonzero(region.contains(state.x))
    weight, x, v = state.radius[inside] ** 2, state.x[inside], state.v[inside]
    undefined = dict.fromkeys(STRAIN_RATE, np.nan), np.zeros((3, near.count))
    if len(inside) < FEWEST:
        return undefined
    x, v = (of_disc - weight @ of_disc / weight.sum() for of_disc in (x, v))
    second = (x * weight[:, None]).T @ x
    if np.linalg.cond(second) > 1e12:
        return undefined
    lever = np.linalg.solve(second, (x * weight[:, None]).T).T  # w M^-1 x
    gradient = v.T @ lever
    rest = v - x @ gradient.T
    parts = np.column_stack([rest[:, 0] * lever[:, 0], rest[:, 1] * lever[:, 1], 0.5 * (rest * lever[:, ::-1]).sum(axis=1)])
    rate = (gradient[0, 0], gradient[1, 1], 0.5 * (gradient[0, 1] + gradient[1, 0]))
    return dict(zip(STRAIN_RATE, map(float, rate), strict=True)), _sums(near.body[inside], parts, near.count).T


def _errors(influences: np.ndarray, near: Near, state: Any) -> np.ndarray:
    """Standard errors (q,) of means from the influences (q, count) of bodies; NaN where bodies are too few."""
    chosen = np.flatnonzero(influences.any(axis=0))
    place = np.concatenate([state.x, state.clumps.motion[:, :2]]) if state.clumps is not None else state.x
    if len(chosen) < FEWEST:
        return np.full(len(influences), np.nan)
    found = spreads_of_bodies(influences[:, chosen].astype(complex), place[chosen])
    error = np.sqrt([spread.covariance[0, 0] for spread in found])
    return np.where(np.isfinite(error), error, np.nan)


def _mean_of(values: np.ndarray, chosen: np.ndarray) -> tuple[float, np.ndarray]:
    """Mean of the chosen values, and the influence (n,) of each on it; NaN and zeros if none is chosen."""
    count = int(np.count_nonzero(chosen))
    if count == 0:
        return np.nan, np.zeros(len(values))
    mean = float(values[chosen].mean())
    return mean, np.where(chosen, values - mean, 0.0) / count


def _to_both(near: Near, of_contacts: np.ndarray) -> np.ndarray:
    """Sums (count, k) of values of contacts (m, k) for both bodies of each."""
    pairs = near.pairs
    return _sums(near.body[pairs.disc_a], of_contacts, near.count) + _sums(near.body[pairs.disc_b], of_contacts, near.count)


def _sums(body: np.ndarray, values: np.ndarray, count: int) -> np.ndarray:
    """Sums (count, k) of rows (m, k) by body (m,)."""
    return np.stack([np.bincount(body, column, count) for column in values.T], axis=1).astype(float)  # without rows: of integers
