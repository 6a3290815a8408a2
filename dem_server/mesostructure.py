"""Mesostructure: which stones lie where in a window, until they fill a share C of its area exactly.

    C = sum A_k / A,    A_k = pi s_k^2 / 4,    ln s ~ N(mu, sigma),   mu = ln(mean) - sigma^2 / 2   (1)

The size s of a stone is the diameter of the circle of its area. Sizes outside [min, max] are drawn again; when
enough are drawn they are all scaled by one factor near 1 so that Eq (1) holds exactly. Centroids are uniform in
the window, azimuths uniform on [0, pi).

1. Largest first: each stone is tried at random places, at most TRIES times, then again SHRINK times as large.
2. Where some had to shrink, Monte Carlo with growth: in each sweep every stone makes a random move and, if it
   is not yet what it should be, grows as far as it has room, until all have their size. This fills far more
   than random placing can (.42 to .5); it ends where the fluid of hard polygons jams.

Stones that keep a gap g from each other and from the edge are stones with g/2 more all round in a domain with g/2
less, so the share that counts is

    Phi = sum A(stone + g/2) / A(domain - g/2)                                   (2)

Above 1 nothing fits. Growth jams between REACHED and JAMMED, whatever the gap: beyond that a scene is refused at once.

Source: Study on Failure Mechanism of Soil-Rock Slope with FDM-DEM Method (2022), equations 18 to 21, mended:
the exponent of (18) is -(ln s - mu)^2 / 2 sigma^2, sigma being a standard deviation.
"""

from typing import NamedTuple

import numpy as np
import scipy.optimize
import shapely

from coupler_protocol.interface import polygon_area
from coupler_protocol.jit import jit
from coupler_protocol.problems import unfit
from dem_server.intrusion import fits
from dem_server.polygons import placed, random_outline

TRIES = 1000  # places tried for a stone
SHRINK, SMALLEST = 0.85, 0.1  # factor of the next try, and the last one
SWEEPS = 40000  # of Monte Carlo at most
EARLY, NEAR = 10000, 0.99  # sweeps after which growth goes on only if this share of the area is covered
REACHED, JAMMED = 0.80, 0.85  # of Phi, Eq (2): growth comes that far with nearly every seed, and with none
GROWTH = 0.05  # of its size a stone grows at most in a sweep
MOVE, TURN = 0.1, 0.5  # first step of a move in sizes, of a turn [rad]
ACCEPTED = 0.4  # share of moves accepted, which the length of the step is adapted to


class Mesostructure(NamedTuple):
    """Stones of a window, the largest first.

    outlines: polygon (V_k, 2) of each [m], counter-clockwise; size, flatness, azimuth (S,) [m, -, rad];
    sweeps: of Monte Carlo, 0 where placing the largest first sufficed.
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
    report(text, fraction): progress, if wanted.
    """
    size = draw_sizes(stones.content * polygon_area(domain), stones.size, rng)
    flatness = rng.uniform(*stones.flatness, len(size))
    corners = rng.integers(stones.vertices[0], stones.vertices[1] + 1, len(size))
    outlines = [random_outline(n, f, rng) for n, f in zip(corners.tolist(), flatness, strict=True)]
    reach = np.array([np.hypot(*placed(o, 0.0, 0.0, 1.0).T).max() for o in outlines])
    unit = np.zeros((len(size), corners.max(), 2))
    for k, outline in enumerate(outlines):
        unit[k, : corners[k]] = placed(outline, 0.0, 0.0, 1.0)
    domain = np.ascontiguousarray(domain, dtype=float)
    refuse_jams([s * unit[k, : corners[k]] for k, s in enumerate(size)], domain, stones)
    pieces = unit, corners.astype(np.int64), reach, domain, float(stones.gap)
    place, sweeps = largest_first(size, *pieces, rng), 0
    if place is not None and (place[:, 3] < size).any():
        sweeps = grow(place, size, *pieces, rng, report)
    if place is None or sweeps > SWEEPS:
        covered = 0.0 if place is None else float(place[:, 3] @ place[:, 3] / (size @ size)) * stones.content
        reason = no_room(stones) + (f": they jam at {covered:.3f}" if covered else "")
        raise unfit("stones.content", reason, "choose a smaller content or gap, larger stones, or another seed")
    world = [placed(o, p[:2], p[2], s) for o, p, s in zip(outlines, place, size, strict=True)]
    return Mesostructure(world, size, flatness, place[:, 2] % np.pi, sweeps)


def filled(outlines, domain, gap):
    """Phi, Eq (2): share of the room that stones with half a gap round them would take up; infinite without room."""
    room = shapely.area(shapely.buffer(shapely.Polygon(domain), -0.5 * gap))
    grown = shapely.area(shapely.buffer([shapely.Polygon(outline) for outline in outlines], 0.5 * gap)).sum()
    return float(grown / room) if room > 0.0 else np.inf


def refuse_jams(outlines, domain, stones):
    """Refuse stones (polygons in their sizes, wherever they are) that growth could not bring into the domain."""
    share = filled(outlines, domain, stones.gap)
    if share <= JAMMED:
        return
    remedy = f"choose a content up to {REACHED / share * stones.content:.2f}"
    if filled(outlines, domain, 0.0) < REACHED:
        gap = scipy.optimize.brentq(lambda g: filled(outlines, domain, g) - REACHED, 0.0, stones.gap, xtol=1e-4)
        remedy += f", a gap up to {gap:.3f} m"
    reason = no_room(stones) + (
        f": with half the gap round them they would fill {100.0 * share:.0f} % of the room; "
        f"randomly placed ones jam before {100.0 * JAMMED:.0f} %"
    )
    raise unfit("stones.content", reason, f"{remedy}, or larger stones")


def no_room(stones):
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
        drawn = drawn[:-1]  # without the last one the sum is nearer

    def excess(factor):
        return 0.25 * np.pi * (np.clip(factor * drawn, size.min, size.max) ** 2).sum() - area

    low, high = size.min / drawn.max(), size.max / drawn.min()
    if excess(low) > 0.0:
        reason = f"a single stone of {size.min:g} m covers more than the {area:.3g} m2 asked for"
        raise unfit("stones.size.min", reason, "choose smaller stones")
    while excess(high) < 0.0:  # all at their largest: one more is needed
        drawn = np.append(drawn, size.max)
    factor = scipy.optimize.brentq(excess, low, high, xtol=1e-15, rtol=1e-14)
    return np.sort(np.clip(factor * drawn, size.min, size.max))[::-1]


def largest_first(size, unit, corners, reach, domain, gap, rng):
    """Places (S, 4) of all stones, each at the first random place where it fits, if need be smaller; None without any room."""
    place, world = np.zeros((len(size), 4)), np.zeros_like(unit)
    there = np.zeros(len(size), dtype=np.bool_)
    low, span = domain.min(axis=0), np.ptp(domain, axis=0)
    for k, s in enumerate(size):
        scale = 1.0
        while not there[k]:
            if scale < SMALLEST:
                return None
            tried = rng.random((TRIES, 3)) * [*span, np.pi] + [*low, 0.0]
            there[k] = try_places(k, tried, scale * s, place, unit, corners, reach, world, there, domain, gap)
            scale *= SHRINK
    return place


@jit
def try_places(k, tried, size, place, unit, corners, reach, world, there, domain, gap):
    """Put stone k at the first of the places `tried` (t, 3) where it fits; False if there is none."""
    for t in range(len(tried)):
        place[k, 0], place[k, 1], place[k, 2], place[k, 3] = tried[t, 0], tried[t, 1], tried[t, 2], size
        put(k, place, unit, corners, world)
        if fits(k, world, corners, place, reach, there, domain, gap):
            return True
    return False


@jit
def put(k, place, unit, corners, world):
    """Corners of stone k where `place` says."""
    c, s = place[k, 3] * np.cos(place[k, 2]), place[k, 3] * np.sin(place[k, 2])
    for i in range(corners[k]):
        world[k, i, 0] = place[k, 0] + c * unit[k, i, 0] - s * unit[k, i, 1]
        world[k, i, 1] = place[k, 1] + s * unit[k, i, 0] + c * unit[k, i, 1]


def grow(place, size, unit, corners, reach, domain, gap, rng, report=None):
    """Move and grow all stones until they have their `size` (S,); returns the number of sweeps it took, SWEEPS + 1 in vain."""
    world, there = np.zeros_like(unit), np.ones(len(size), dtype=np.bool_)
    for k in range(len(size)):
        put(k, place, unit, corners, world)
    step = 1.0
    for sweep in range(1, SWEEPS + 1):
        random = rng.random((len(size), 4))
        moved = move_all(random, step, place, size, unit, corners, reach, world, there, domain, gap)
        if (place[:, 3] == size).all():
            return sweep
        covered = float(place[:, 3] @ place[:, 3] / (size @ size))
        if sweep == EARLY and covered < NEAR:
            break
        if report and sweep % 100 == 0:
            report("stones grow", covered)
        step = min(max(step * (1.1 if moved > ACCEPTED * len(size) else 0.9), 1e-3), 5.0)
    return SWEEPS + 1


@jit
def move_all(random, step, place, size, unit, corners, reach, world, there, domain, gap):
    """One sweep: every stone moves, turns and grows at random where it fits; returns how many moved."""
    moved = 0
    for k in range(len(size)):
        x, y, azimuth, before = place[k, 0], place[k, 1], place[k, 2], place[k, 3]
        length = 2.0 * MOVE * step * size[k]
        place[k, 0] += length * (random[k, 0] - 0.5)
        place[k, 1] += length * (random[k, 1] - 0.5)
        place[k, 2] += 2.0 * TURN * step * (random[k, 2] - 0.5)
        put(k, place, unit, corners, world)
        if fits(k, world, corners, place, reach, there, domain, gap):
            moved += 1
        else:
            place[k, 0], place[k, 1], place[k, 2] = x, y, azimuth
            put(k, place, unit, corners, world)
        if before < size[k]:
            place[k, 3] = min(before * (1.0 + GROWTH * random[k, 3]), size[k])
            put(k, place, unit, corners, world)
            if not fits(k, world, corners, place, reach, there, domain, gap):
                place[k, 3] = before
                put(k, place, unit, corners, world)
    return moved
