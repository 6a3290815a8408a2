"""Mesostructure: random stones in a window that fill exactly the share C of its area.

    C = sum A_k / A,    A_k = pi s_k^2 / 4,    ln s ~ N(mu, sigma),   mu = ln(mean) - sigma^2 / 2   (1)

The size s of a stone is the diameter of the circle of equal area. Sizes outside [min, max] are drawn again; when
enough are drawn, all are scaled by one factor near 1 so that Eq (1) is exact. Centroids are uniform in the
window. Azimuths are uniform on [0, pi), or drawn once for each stone from the distribution of the scene,

    theta = mean + spread N(0, 1) mod pi,   |<exp(2 i theta)>| = exp(-2 spread^2)   (2)

(wrapped normal on twice the angle; Mardia & Jupp 2000, Directional Statistics, section 3.5.7) or uniformly from a range.
A stone keeps its azimuth or exchanges it with another stone; free rotation would change the distribution.

1. Largest first: each stone is tried at a number of random positions, then again somewhat smaller.
2. If some had to shrink, Monte Carlo with growth: in each sweep every stone makes a random move and grows as far as
   it has room, until all have their size. This fills far more than random placing can (0.42 to 0.5); the limit is
   the jamming of hard polygons (placing.py).

Stones with a gap g between each other and to the edge are equivalent to stones enlarged by g/2 in a domain reduced by
g/2, so the effective share is

    Phi = sum A(stone + g/2) / A(domain - g/2)                                   (3)

A share above 1 is impossible. Growth jams between REACHED and JAMMED for any gap; above JAMMED a scene is refused.

Source: Study on Failure Mechanism of Soil-Rock Slope with FDM-DEM Method (2022), equations 18 to 21, corrected:
the exponent of (18) is -(ln s - mu)^2 / 2 sigma^2, sigma being a standard deviation.
"""

from typing import NamedTuple

import numpy as np
import scipy
import shapely

from coupler_protocol.geometry import moments, polygon_area
from coupler_protocol.problems import unfit
from dem_server.stones.placing import SWEEPS, grow, largest_first
from dem_server.stones.polygons import normalised, placed, random_outline
from dem_server.stones.traced_stones import outlines_of

REACHED, JAMMED = 0.80, 0.85  # of Phi, Eq (3): growth reaches the first with nearly every seed, the second with none


class Mesostructure(NamedTuple):
    """Stones of a window, the largest first.

    outlines: polygon (V_k, 2) of each [m], counter-clockwise; size, flatness, azimuth (S,) [m, -, rad];
    sweeps: of Monte Carlo, 0 if placing the largest first was sufficient.
    """

    outlines: list
    size: np.ndarray
    flatness: np.ndarray
    azimuth: np.ndarray
    sweeps: int

    @property
    def area(self):
        """Area of all stones [m2]."""
        return float(sum(polygon_area(outline) for outline in self.outlines))


def draw(domain, stones, rng, report=None):
    """Mesostructure of a window.

    domain (P, 2): simple polygon, counter-clockwise [m]; stones: the scene's table; rng: numpy Generator;
    report(text, fraction): called with the progress, or None. Raises SceneError if the stones do not fit.
    """
    size = draw_sizes(stones.content * polygon_area(domain), stones.size, rng)
    outlines, flatness = draw_outlines(len(size), stones, rng)
    azimuth = None if stones.azimuth is None else draw_azimuths(len(size), stones.azimuth, rng)
    corners = np.array([len(outline) for outline in outlines], dtype=np.int64)
    reach = np.array([np.hypot(*placed(o, 0.0, 0.0, 1.0).T).max() for o in outlines])
    unit = np.zeros((len(size), corners.max(), 2))
    for k, outline in enumerate(outlines):
        unit[k, : corners[k]] = placed(outline, 0.0, 0.0, 1.0)
    domain = np.ascontiguousarray(domain, dtype=float)
    refuse_jams([s * unit[k, : corners[k]] for k, s in enumerate(size)], domain, stones)
    pieces = unit, corners, reach, domain, float(stones.gap), azimuth
    place, sweeps = largest_first(size, *pieces, rng), 0
    if place is not None and (place[:, 3] < size).any():
        sweeps = grow(place, size, *pieces, rng, report)
    if place is None or sweeps > SWEEPS:
        covered = 0.0 if place is None else float(place[:, 3] @ place[:, 3] / (size @ size)) * stones.content
        reason = no_room(stones) + (f": they jam at {covered:.3f}" if covered else "")
        raise unfit("stones.content", reason, "choose a smaller content or gap, larger stones, or another seed")
    world = [placed(o, p[:2], p[2], s) for o, p, s in zip(outlines, place, size, strict=True)]
    return Mesostructure(world, size, flatness, place[:, 2] % np.pi, sweeps)


def draw_outlines(number, stones, rng):
    """Outlines of area 1 with the long axis along x, and their flatness (number,): random, or copies of traced ones."""
    if stones.shapes is None:
        flatness = rng.uniform(*stones.flatness, number)
        corners = rng.integers(stones.vertices[0], stones.vertices[1] + 1, number)
        return [random_outline(n, f, rng) for n, f in zip(corners.tolist(), flatness, strict=True)], flatness
    library = [normalised(traced.corners) for traced in outlines_of(stones, "shapes")]
    chosen, half_turn = rng.integers(len(library), size=number), rng.choice([-1.0, 1.0], number)
    outlines = [sign * library[k] for k, sign in zip(chosen.tolist(), half_turn, strict=True)]
    return outlines, np.array([moments(outline).flatness for outline in outlines])


def draw_azimuths(number, azimuth, rng):
    """Azimuths (number,) [rad], Eq (2) or uniform in a range."""
    if azimuth.range is not None:
        return np.radians(rng.uniform(*azimuth.range, number))
    return np.radians(rng.normal(azimuth.mean, azimuth.spread, number))


def filled(outlines, domain, gap):
    """Phi of Eq (3) [-]: share of the room that stones enlarged by half a gap would fill; infinite without room."""
    room = shapely.area(shapely.buffer(shapely.Polygon(domain), -0.5 * gap))
    grown = shapely.area(shapely.buffer([shapely.Polygon(outline) for outline in outlines], 0.5 * gap)).sum()
    return float(grown / room) if room > 0.0 else np.inf


def refuse_jams(outlines, domain, stones):
    """Raises SceneError for stones (polygons in their sizes, at any position) that growth could not fit into the domain."""
    share = filled(outlines, domain, stones.gap)
    if share <= JAMMED:
        return
    remedy = f"choose a content up to {REACHED / share * stones.content:.2f}"
    if filled(outlines, domain, 0.0) < REACHED:
        gap = scipy.optimize.brentq(lambda g: filled(outlines, domain, g) - REACHED, 0.0, stones.gap, xtol=1e-4)
        remedy += f", a gap up to {gap:.3f} m"
    reason = no_room(stones) + (
        f": with half the gap around them they would fill {100.0 * share:.0f} % of the room; "
        f"randomly placed ones jam before {100.0 * JAMMED:.0f} %"
    )
    raise unfit("stones.content", reason, f"{remedy}, or larger stones")


def no_room(stones):
    """Text of the problem that stones do not fit."""
    return f"no room for a content of {stones.content:g} with a gap of {stones.gap:g} m between stones of these sizes"


def draw_sizes(area, size, rng):
    """Sizes (S,) [m], largest first, of stones that cover `area` [m2] exactly; size: mean, sigma, min, max."""
    mu = np.log(size.mean) - 0.5 * size.sigma**2
    drawn, covered = [], 0.0
    while covered < area:
        s = np.exp(rng.normal(mu, size.sigma))
        if size.min <= s <= size.max:
            drawn.append(s)
            covered += 0.25 * np.pi * s * s
    drawn = np.array(drawn)
    if len(drawn) > 1 and covered - area > 0.125 * np.pi * drawn[-1] ** 2:
        drawn = drawn[:-1]  # without the last one the sum is closer

    def excess(factor):
        return 0.25 * np.pi * (np.clip(factor * drawn, size.min, size.max) ** 2).sum() - area

    low, high = size.min / drawn.max(), size.max / drawn.min()
    if excess(low) > 0.0:
        reason = f"a single stone of {size.min:g} m covers more than the {area:.3g} m2 asked for"
        raise unfit("stones.size.min", reason, "choose smaller stones")
    while excess(high) < 0.0:  # all have the largest size: one more is needed
        drawn = np.append(drawn, size.max)
    factor = scipy.optimize.brentq(excess, low, high, xtol=1e-15, rtol=1e-14)
    return np.sort(np.clip(factor * drawn, size.min, size.max))[::-1]
