"""Overlaps of discs from a file: what is refused, and how strong ones begin calmly.

They are stored energy, which real time sets free. With the overlap d of two discs of the contact stiffness kn

    E = sum kn d^2 / 2                                                           (1)

is reported. Where an overlap is larger than BURST of the smaller radius a first stage in real time is refused: the two would
part at about d sqrt(kn / m). Before a static stage such discs are drawn apart by steps from rest, x += F / m, so that none of
that energy becomes motion, until no overlap is larger than LEFT, or the walls do not let them.
"""

import numpy as np
import shapely
from scipy.spatial import cKDTree

from coupler_protocol.problems import unfit
from dem_server import cycle
from dem_server.contacts import contact_forces
from dem_server.fields import listed_pairs
from dem_server.model import CAPS
from dem_server.motion import move_free

BURST = 0.1  # of the smaller radius: largest overlap of two discs that may begin as they are
LEFT = 1e-3  # of the smaller radius: largest overlap that is left of larger ones than BURST
APART, LOOK = 5000, 50  # steps of drawing apart at most, and after how many it is looked whether they still help
SAME = 1e-6  # of the smaller radius: centres nearer than this are one place, and a contact has no direction
DEEP = 0.2  # of the smaller radius: largest overlap in the packing of a window, of two discs or of one with the ring


def pairs_of(xy, radius, stone):
    """Pairs (m, 2) of discs that overlap, but not of one stone, and by how much (m,) [m]."""
    pairs = cKDTree(xy).query_pairs(2.0 * radius.max(), output_type="ndarray")
    depth = radius[pairs].sum(axis=1) - np.hypot(*(xy[pairs[:, 1]] - xy[pairs[:, 0]]).T)
    there = depth > 0.0
    if stone is not None:
        there &= (stone[pairs] < 0).any(axis=1) | (stone[pairs[:, 0]] != stone[pairs[:, 1]])
    return pairs[there], depth[there]


def refuse_same_place(path, found, pairs, depth, smaller):
    """A contact of two discs in one place has no direction."""
    same = np.flatnonzero(found.radius[pairs].sum(axis=1) - depth < SAME * smaller)
    if len(same):
        i, j = pairs[same[0]] + 1
        why = f"{path}: discs {i} and {j} are in the same place" + (f", and {len(same) - 1} more pairs" if len(same) > 1 else "")
        raise unfit("discs.file", why, "remove one of them, or move it")


def refuse_on_walls(path, found, walls):
    """A contact of a wall with a disc whose centre lies on it has no direction."""
    centres = shapely.points(found.xy)
    for k, wall in enumerate(walls, start=1):
        on = np.flatnonzero(shapely.distance(shapely.LineString(wall.ends), centres) < SAME * found.radius)
        if len(on):
            why = f"{path}: the centre of disc {on[0] + 1} lies on wall {wall.name or k}"
            raise unfit("discs.file", why, "move the wall, or the disc to the side where it belongs")


def refuse_burst(path, found, pairs, depth, smaller):
    """Overlaps that would part like an explosion."""
    deep = depth / smaller
    if (deep > BURST).any():
        worst = int(deep.argmax())
        (i, j), count = pairs[worst] + 1, int((deep > BURST).sum())
        why = f"{path}: discs {i} and {j} overlap by {deep[worst]:.2g} of the smaller radius, {count} pairs by more than "
        why += f"{BURST:g}: in real time they would burst apart"
        raise unfit("discs.file", why, 'begin with a static stage (leave time = "real" out of it), or mend the file')


def refuse_deep(path, depth, smaller):
    """Discs of a window that overlap wildly are no packing."""
    deep = depth / smaller
    if (deep > DEEP).any():
        why = f"{path}: {int((deep > DEEP).sum())} pairs of discs overlap by more than {DEEP:g} of the smaller radius, "
        raise unfit("discs.file", f"{why}the worst by {deep.max():.2g}", "bring them to rest as discs alone, and export them")


def refuse_ring_overlaps(path, found, ring):
    """Discs of a file that lie deep in the control discs were packed for another window."""
    reach = float(ring.radius.max() + found.radius.max())
    near = cKDTree(ring.xy).sparse_distance_matrix(cKDTree(found.xy), reach, output_type="ndarray")
    smaller = np.minimum(ring.radius[near["i"]], found.radius[near["j"]])
    deep = (ring.radius[near["i"]] + found.radius[near["j"]] - near["v"]) / smaller
    if (deep > DEEP).any():
        worst, count = int(near["j"][deep.argmax()]), int((deep > DEEP).sum())
        why = f"{count} overlaps of {path} with the ring's control discs are larger than {DEEP:g} of the smaller radius; "
        why += f"the worst is {deep.max():.2g}, of disc {worst + 1}"
        raise unfit("discs.file", why, "export discs from a run whose window has this shape and whose discs have this radius")


def draw_apart(model, state):
    """Draw discs apart that overlap by more than BURST, walls held; returns the model, in static mode, and what is left of it.

    The shear that the contacts have seen by then is forgotten.
    """
    deepest = largest_overlap(state)
    if deepest <= BURST:
        return model, {}
    model, steps, before = cycle.in_static_mode(model, state), 0, np.inf
    contact_forces(model, state)
    while steps < APART and deepest > LEFT and deepest < 0.99 * before:
        for _ in range(LOOK):
            move_free(model, state, 0.0)
            cycle.stop(state)
            contact_forces(model, state)
        steps, before, deepest = steps + LOOK, deepest, largest_overlap(state)
    if state.shear is not None:
        state.shear[:] = 0.0
    state.counters[CAPS] = 0
    return model, {"drawn_apart_steps": steps, "overlap_left": deepest}


def largest_overlap(state):
    """Largest overlap of two listed discs over the smaller radius [-]."""
    pairs = listed_pairs(state)
    smaller = np.minimum(state.radius[pairs.disc_a], state.radius[pairs.disc_b])
    return float((-pairs.gap / smaller).max(initial=0.0))
