"""Rules for discs of a file: positions, overlaps, material; found through `colluvium.rules`.

Overlaps are stored energy, which becomes motion in real time. With an overlap above BURST of the (smaller) radius, a first
stage in real time is refused: discs would separate at about d sqrt(kn / m), d being the overlap.
"""

import numpy as np
import scipy
import shapely

from coupler_protocol.files import disc_csv
from coupler_protocol.problems import SceneError, unfit
from coupler_protocol.scene.rules.window_tables import in_all_windows

BURST = 0.1  # of the smaller radius: largest overlap of two discs, or of one with a wall, at the start
SAME = 1e-6  # of the smaller radius: two centres closer than this are one position, and a contact has no direction
DEEP = 0.2  # of the smaller radius: largest overlap in the packing of a window, of two discs or of one with the ring


@in_all_windows
def discs_of_a_file_can_begin(scene):
    """The file of discs exists, is valid in every line, and its discs can begin at their positions."""
    if scene.discs is None or scene.discs.file is None:
        return
    at, path = ("discs", "file"), scene.discs.file
    try:
        found = disc_csv.read(path)
    except SceneError as error:
        for problem in error.problems:
            line = "" if problem.line is None else f"{path}:{problem.line}: "
            yield at, line + problem.reason, problem.remedy
        return
    if scene.grid is not None:
        return
    if found.stone is not None and scene.discs.stone is None:
        yield ("discs", "stone"), f"{path} has stones, which have no material", "add a [discs.stone] table"
    pairs, depth = pairs_of(found.xy, found.radius, found.stone)
    smaller = found.radius[pairs].min(axis=1)
    checks = [(refuse_same_place, (path, found, pairs, depth, smaller)), (refuse_on_walls, (path, found, scene.discs.wall))]
    if len(scene.stage) > 1 and scene.stage[1].in_real_time:
        checks += [(refuse_burst, (path, found, pairs, depth, smaller)), (refuse_deep_in_walls, (path, found, scene.discs.wall))]
    for check, arguments in checks:
        try:
            check(*arguments)
        except SceneError as error:
            yield from ((at, problem.reason, problem.remedy) for problem in error.problems)


def material_of_stones_not_there(scene):
    """A doubt: a material of stones beside a file without stones."""
    if scene.discs is None or scene.discs.file is None or scene.discs.stone is None or scene.grid is not None:
        return
    if disc_csv.read(scene.discs.file).stone is None:
        yield ("discs", "stone"), f"{scene.discs.file} has no stones that would use this material", "remove the table"


def pairs_of(xy, radius, stone):
    """Pairs (m, 2) of discs that overlap, except within one stone, and their overlaps (m,) [m]."""
    pairs = scipy.spatial.cKDTree(xy).query_pairs(2.0 * radius.max(), output_type="ndarray")
    depth = radius[pairs].sum(axis=1) - np.hypot(*(xy[pairs[:, 1]] - xy[pairs[:, 0]]).T)
    there = depth > 0.0
    if stone is not None:
        there &= (stone[pairs] < 0).any(axis=1) | (stone[pairs[:, 0]] != stone[pairs[:, 1]])
    return pairs[there], depth[there]


def refuse_same_place(path, found, pairs, depth, smaller):
    """Raises SceneError for two discs at one position: their contact has no direction."""
    same = np.flatnonzero(found.radius[pairs].sum(axis=1) - depth < SAME * smaller)
    if len(same):
        i, j = pairs[same[0]] + 1
        why = f"{path}: discs {i} and {j} are in the same place" + (f", and {len(same) - 1} more pairs" if len(same) > 1 else "")
        raise unfit("discs.file", why, "remove one of them, or move it")


def refuse_on_walls(path, found, walls):
    """Raises SceneError for a disc whose centre is on a wall: their contact has no direction."""
    centres = shapely.points(found.xy)
    for k, wall in enumerate(walls, start=1):
        on = np.flatnonzero(shapely.distance(shapely.LineString(wall.ends), centres) < SAME * found.radius)
        if len(on):
            why = f"{path}: the centre of disc {on[0] + 1} lies on wall {wall.name or k}"
            raise unfit("discs.file", why, "move the wall, or move the disc to one side of it")


def refuse_burst(path, found, pairs, depth, smaller):
    """Raises SceneError for overlaps above BURST, which would separate like an explosion in real time."""
    deep = depth / smaller
    if (deep > BURST).any():
        worst = int(deep.argmax())
        (i, j), count = pairs[worst] + 1, int((deep > BURST).sum())
        why = f"{path}: discs {i} and {j} overlap by {deep[worst]:.2g} of the smaller radius, {count} pairs by more than "
        why += f"{BURST:g}: in real time they would burst apart"
        raise unfit("discs.file", why, 'start with a static stage (without time = "real"), or correct the file')


def refuse_deep(path, depth, smaller):
    """Raises SceneError for discs of a window that overlap by more than DEEP: they are not a packing."""
    deep = depth / smaller
    if (deep > DEEP).any():
        why = f"{path}: {int((deep > DEEP).sum())} pairs of discs overlap by more than {DEEP:g} of the smaller radius, "
        raise unfit("discs.file", f"{why}the worst by {deep.max():.2g}", "bring them to rest as discs alone, and export them")


def refuse_ring_overlaps(path, found, ring):
    """Raises SceneError for overlaps above DEEP with control discs: the discs were packed for another window."""
    reach = float(ring.radius.max() + found.radius.max())
    near = scipy.spatial.cKDTree(ring.xy).sparse_distance_matrix(scipy.spatial.cKDTree(found.xy), reach, output_type="ndarray")
    smaller = np.minimum(ring.radius[near["i"]], found.radius[near["j"]])
    deep = (ring.radius[near["i"]] + found.radius[near["j"]] - near["v"]) / smaller
    if (deep > DEEP).any():
        worst, count = int(near["j"][deep.argmax()]), int((deep > DEEP).sum())
        why = f"{count} overlaps of {path} with the ring's control discs are larger than {DEEP:g} of the smaller radius; "
        why += f"the worst is {deep.max():.2g}, of disc {worst + 1}"
        raise unfit("discs.file", why, "export discs from a run whose window has this shape and whose discs have this radius")


def refuse_deep_in_walls(path, found, walls):
    """Raises SceneError for overlaps with walls above BURST, which would eject discs in real time."""
    centres = shapely.points(found.xy)
    for k, wall in enumerate(walls, start=1):
        deep = 1.0 - shapely.distance(shapely.LineString(wall.ends), centres) / found.radius
        if (deep > BURST).any():
            worst, count = int(deep.argmax()), int((deep > BURST).sum())
            why = f"{path}: disc {worst + 1} overlaps wall {wall.name or k} by {deep[worst]:.2g} of its radius, {count} discs "
            why += f"by more than {BURST:g}: in real time they would be ejected"
            raise unfit("discs.file", why, 'start with a static stage (without time = "real"), or correct the file')
