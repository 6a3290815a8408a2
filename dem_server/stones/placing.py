"""Positions of stones: the largest first, then Monte Carlo in which all move, turn and grow until they have their size.

Stones are rows, as in overlap.py. `azimuth` (S,) [rad]: the required directions. Then stones do not turn, but two stones with
consecutive directions exchange them if both have room, so all directions remain. None: any direction; stones turn as they move.
"""

import numpy as np

from coupler_protocol.compiled.jit import jit
from dem_server.stones.overlap import fits

TRIES = 1000  # positions tried for a stone
SHRINK, SMALLEST = 0.85, 0.1  # factor of the next try, and the last one
SWEEPS = 40000  # of Monte Carlo at most
EARLY, NEAR = 10000, 0.99  # sweeps after which growth continues only if this share of the area is covered
GROWTH = 0.05  # largest growth of a stone in a sweep, as a share of its size
MOVE, TURN = 0.1, 0.5  # first step of a move in sizes, of a turn [rad]
ACCEPTED = 0.4  # share of moves accepted, which the length of the step is adapted to


def largest_first(size, unit, corners, reach, domain, gap, azimuth, rng):
    """Places (S, 4) of all stones, each at the first random position where it fits, smaller if necessary; None without room."""
    place, world = np.zeros((len(size), 4)), np.zeros_like(unit)
    there = np.zeros(len(size), dtype=np.bool_)
    low, span = domain.min(axis=0), np.ptp(domain, axis=0)
    for k, s in enumerate(size):
        scale = 1.0
        while not there[k]:
            if scale < SMALLEST:
                return None
            tried = rng.random((TRIES, 3)) * [*span, np.pi] + [*low, 0.0]
            if azimuth is not None:
                tried[:, 2] = azimuth[k]
            there[k] = try_places(k, tried, scale * s, place, unit, corners, reach, world, there, domain, gap)
            scale *= SHRINK
    return place


@jit
def try_places(k, tried, size, place, unit, corners, reach, world, there, domain, gap):
    """Places stone k at the first of the positions `tried` (t, 3) where it fits; returns False if there is none."""
    for t in range(len(tried)):
        place[k, 0], place[k, 1], place[k, 2], place[k, 3] = tried[t, 0], tried[t, 1], tried[t, 2], size
        put(k, place, unit, corners, world)
        if fits(k, world, corners, place, reach, there, domain, gap):
            return True
    return False


@jit
def put(k, place, unit, corners, world):
    """Sets the corners of stone k in `world` from `place`."""
    c, s = place[k, 3] * np.cos(place[k, 2]), place[k, 3] * np.sin(place[k, 2])
    for i in range(corners[k]):
        world[k, i, 0] = place[k, 0] + c * unit[k, i, 0] - s * unit[k, i, 1]
        world[k, i, 1] = place[k, 1] + s * unit[k, i, 0] + c * unit[k, i, 1]


def grow(place, size, unit, corners, reach, domain, gap, azimuth, rng, report=None):
    """Moves and grows all stones until they have their `size` (S,); returns the number of sweeps, SWEEPS + 1 without success."""
    world, there = np.zeros_like(unit), np.ones(len(size), dtype=np.bool_)
    for k in range(len(size)):
        put(k, place, unit, corners, world)
    step, turn = 1.0, TURN if azimuth is None else 0.0
    order = np.argsort(place[:, 2])
    for sweep in range(1, SWEEPS + 1):
        random = rng.random((len(size), 4))
        if azimuth is not None:
            swap_all(order, place, unit, corners, reach, world, there, domain, gap)
        moved = move_all(random, step, turn, place, size, unit, corners, reach, world, there, domain, gap)
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
def move_all(random, step, turn, place, size, unit, corners, reach, world, there, domain, gap):
    """Takes one sweep: every stone moves, turns and grows at random if it fits; returns the number of moved stones."""
    moved = 0
    for k in range(len(size)):
        x, y, azimuth, before = place[k, 0], place[k, 1], place[k, 2], place[k, 3]
        length = 2.0 * MOVE * step * size[k]
        place[k, 0] += length * (random[k, 0] - 0.5)
        place[k, 1] += length * (random[k, 1] - 0.5)
        place[k, 2] += 2.0 * turn * step * (random[k, 2] - 0.5)
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


@jit
def swap_all(order, place, unit, corners, reach, world, there, domain, gap):
    """Exchanges the azimuths of stones that are neighbours in the `order` (S,) of azimuths, if both fit."""
    for m in range(len(order) - 1):
        i, j = order[m], order[m + 1]
        place[i, 2], place[j, 2] = place[j, 2], place[i, 2]
        put(i, place, unit, corners, world)
        put(j, place, unit, corners, world)
        both = fits(i, world, corners, place, reach, there, domain, gap)
        if both and fits(j, world, corners, place, reach, there, domain, gap):
            order[m], order[m + 1] = j, i
        else:
            place[i, 2], place[j, 2] = place[j, 2], place[i, 2]
            put(i, place, unit, corners, world)
            put(j, place, unit, corners, world)
