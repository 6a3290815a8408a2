"""A net of cells below a ground surface of any angle: gridpoints next to the surface move onto it.

The net has lines through the profile's points. The surface follows a path of its gridpoints: along each straight part of the
profile, from column to column (from row to row where it is steep) to the nearest gridpoint, along sides and diagonals of cells.
These gridpoints then move onto the profile, by half a cell at most, or farther if profile points are closer to each other than
half a cell. Gridpoints up to `DEPTH` sides below also move (by the mean of their neighbours); all others are unchanged, so that
zones there are rectangles. Tops of materials are treated in the same way (fdm_server/mesh/ground_layers.py).
"""

from itertools import pairwise

import numpy as np
import scipy

from coupler_protocol.geometry import NOWHERE, spot
from fdm_server.mesh.diagonal_net import cells_below, check_extent, renumbered
from fdm_server.mesh.graded_lines import net_lines
from fdm_server.mesh.ground_layers import cut_cells, pieces_below
from fdm_server.step.blocks import triangle_double_areas

DEPTH = 3  # sides from the surface to the farthest gridpoints that move
WORST = 4.0  # largest aspect of a zone


def fitted_mesh(g, tops=()):
    """Gridpoints xy (N,2) [m], zones (Z,4), column and row (Z,) of the table [grid].

    tops: lines (points from left to right) that zones follow: level lines exactly, others if the aspect of zones permits.
    Raises ValueError with a remedy.
    """
    profile = np.array([(0.0, g.height), (g.length, g.height)] if g.kind == "box" else g.profile, dtype=np.float64)
    _check_profile(profile, g)
    profile[[0, -1], 0] = 0.0, g.length
    levels = levels_of(tops)
    (fine_x, fine_y), ratio = ((None, None), 1.0) if g.graded is None else ((g.graded.x, g.graded.y), g.graded.ratio)
    x = net_lines(g.length, g.zone_size[0], profile[:, 0], fine_x, ratio)
    y = net_lines(profile[:, 1].max(), g.zone_size[1], [*profile[:, 1], *levels], fine_y, ratio)
    origin = g.origin or NOWHERE
    mesh, followed = _mesh(profile, x, y, levels, [], g.zone_size, origin, g.graded is not None), []
    for line in (line for line in tops if not is_level(line)):
        try:
            mesh = _mesh(profile, x, y, levels, [*followed, line], g.zone_size, origin)
            followed.append(line)
        except ValueError:  # this line makes zones too flat
            continue
    return mesh


def is_level(line):
    """Whether all points of a line have the same height."""
    return len({y for _, y in line}) == 1


def levels_of(lines):
    """Heights [m] of the level lines among `lines`."""
    return [line[0][1] for line in lines if is_level(line)]


def _mesh(profile, x, y, levels, lines, size, origin, graded=False):
    """The mesh of a net with lines x, y below a profile, its zones following `lines`; graded: whether sizes grow."""
    parts = []
    for line in lines:
        found, profile = pieces_below(line, profile, size)
        parts += found
    path, place = _path(profile, x, y, origin)
    if len(np.unique(path, axis=0)) < len(path):
        raise ValueError("the profile has a notch or a wall narrower than a zone somewhere: use smaller zones")
    (i0, j0), (i1, j1) = path[:-1].T, path[1:].T
    across = i1 > i0
    corners, column, row = cells_below(j0[across], j1[across])
    inner = [_path(part, x, y, origin, ground=False) for part in parts]
    for way, _ in inner:
        below = np.isin(way @ (1, len(x)), corners)
        corners, column, row = cut_cells(corners, column, row, way[below])
    used, zones = renumbered(corners)
    goal = {}  # position of every gridpoint on a path; the ground surface takes precedence
    for way, places in inner:
        (i, j), (px, py) = way.T, places.T
        stays = ((j > 0) | (py == 0.0)) & ((i > 0) | (px == 0.0)) & ((i < len(x) - 1) | (px == x[-1]))  # on the grid's sides
        goal |= zip((way @ (1, len(x)))[stays].tolist(), places[stays], strict=True)
    goal |= zip((path @ (1, len(x))).tolist(), place, strict=True)
    if not np.all(np.isin(path @ (1, len(x)), used)):
        raise ValueError("the ground is thinner than a zone somewhere: use smaller zones")
    given = [k for k, n in enumerate(used.tolist()) if n in goal]
    j, i = np.divmod(used, len(x))
    xy = np.column_stack([x[i], y[j]])
    level = np.min([np.abs(xy[:, 1] - h) for h in (0.0, *levels)], axis=0) < 1e-9 * y[-1]
    held = np.column_stack([np.isin(i, (0, len(x) - 1)) | (j == 0), level])
    xy = _moved(xy, zones, np.array(given), np.array([goal[int(used[k])] for k in given]), held)
    worst = aspects(xy, zones)
    if not worst.max() <= WORST:
        corners = xy[zones[worst.argmax()]]
        centre, (width, height) = corners.mean(axis=0), np.ptp(corners, axis=0)
        stretched = graded and max(width / height, height / width) > sides_of(WORST)  # by the net, not by the profile
        remedy = "use smaller zones, or move the points of the profile there apart"
        remedy = "use a smaller graded.ratio, or grade x and y alike" if stretched else remedy
        raise ValueError(
            f"the zone at {spot(centre, origin)} would be too flat, like a rectangle of {sides_of(worst.max()):.3g} "
            f"to 1 (at most {sides_of(WORST):.2g} to 1): {remedy}"
        )
    return xy, zones, column, row


def sides_of(aspect):
    """Ratio of the sides of a rectangle with this aspect (a/b + b/a)/2."""
    return aspect + np.sqrt(aspect**2 - 1.0) if np.isfinite(aspect) else np.inf


def aspects(xy, zones):
    """Aspect (Z,) [-] of zones: (longest side)^2 / (4 area), largest of their triangles; 1 for a square, inf if inverted.

    A rectangle with sides a, b has (a/b + b/a)/2.
    """
    double = triangle_double_areas(xy, zones)
    longest = np.zeros(double.shape)
    for t, (a, b, c) in enumerate(((0, 1, 2), (0, 2, 3), (0, 1, 3), (1, 2, 3))):
        for p, q in ((a, b), (b, c), (c, a)):
            longest[:, t] = np.maximum(longest[:, t], np.sum((xy[zones[:, p]] - xy[zones[:, q]]) ** 2, axis=1))
    with np.errstate(divide="ignore"):
        aspect = np.where(double > 0.0, longest / (2.0 * np.abs(double)), np.inf)
    aspect[zones[:, 2] == zones[:, 3], 1::2] = 0.0  # triangles that a triangular zone lacks
    return aspect.max(axis=1)


def _check_profile(profile, g):
    check_extent(profile, g, g.zone_size)
    x = profile[:, 0]
    if np.any(np.diff(x) < 0.0):
        raise ValueError(f"profile turns back in x after its point {np.argmin(np.diff(x))}: overhangs cannot be meshed")


def _path(profile, x, y, origin, ground=True):
    """Columns and rows (P,2) of gridpoints along a profile (ground: it is the surface), and their new positions (P,2) [m]."""
    at = np.column_stack([np.abs(lines - v[:, None]).argmin(axis=1) for lines, v in ((x, profile[:, 0]), (y, profile[:, 1]))])
    path, place = [at[0]], [profile[0]]
    for k, (start, end) in enumerate(pairwise(at)):
        steps = np.abs(end - start)
        if not np.any(steps):
            raise ValueError(
                f"the points {spot(profile[k], origin, 6)} and {spot(profile[k + 1], origin, 6)} of the profile are closer than "
                f"half a zone: use smaller zones, or remove one of them"
            )
        along = 0 if steps[0] >= steps[1] else 1
        nodes, share = _straight(start, end, (x, y), along)
        if along == 1 and ground:
            _keep_tips(nodes, start, end, at, k)
        path += list(nodes)
        place += list(profile[k] + share[:, None] * (profile[k + 1] - profile[k]))
    return np.array(path, dtype=np.int64), np.array(place)


def _straight(start, end, lines, along):
    """Gridpoints (n,2) of a straight part after its start, one for each line of the axis `along`, and their shares (n,)."""
    n = abs(end[along] - start[along])
    index = start[along] + np.sign(end[along] - start[along]) * np.arange(1, n + 1)
    first, last = lines[along][start[along]], lines[along][end[along]]
    share = (lines[along][index] - first) / (last - first)
    other = lines[1 - along]
    height = other[start[1 - along]] + share * (other[end[1 - along]] - other[start[1 - along]])
    nearest = np.floor(np.interp(height, other, np.arange(len(other))) + 0.5 + 1e-9).astype(np.int64)
    before = start[1 - along]
    for k in range(n):  # one cell a step at most, and at the end after the last step
        left = n - 1 - k
        nearest[k] = np.clip(nearest[k], max(before - 1, end[1 - along] - left), min(before + 1, end[1 - along] + left))
        before = nearest[k]
    nodes = np.empty((n, 2), dtype=np.int64)
    nodes[:, along], nodes[:, 1 - along] = index, nearest
    return nodes, share


def _keep_tips(nodes, start, end, at, k):
    """Moves the path of a steep part (nodes (n,2), part k of the profile's gridpoints `at`) off the line of a tip at its end.

    A tip is the top of a steep part with no ground behind it, at a side of the grid or with another steep part downwards; or the
    bottom between two steep parts. A path along the line of the tip would enclose no zones.
    """
    before, after = (at[k - 1] - start if k else None), (at[k + 2] - end if k + 2 < len(at) else None)
    run, rise = end - start
    if run > 0 and (_steep(after, -rise) or (after is None and rise > 0)):
        nodes[:-1, 0] = np.minimum(nodes[:-1, 0], end[0] - 1)
    if run > 0 and (_steep(before, rise) or (before is None and rise < 0)):
        nodes[:, 0] = np.maximum(nodes[:, 0], start[0] + 1)


def _steep(part, direction):
    """Whether a part (run, rise) of the profile, or None, is steep in this direction."""
    return part is not None and abs(part[1]) > abs(part[0]) and part[1] * direction > 0


def _moved(xy, zones, surface, place, held):
    """Positions (N,2) [m] with the gridpoints `surface` at `place`; those below follow, except in components `held` (N,2)."""
    pairs = np.concatenate([zones[:, [k, (k + 1) % 4]] for k in range(4)])
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    ones = np.ones(2 * len(pairs))
    ends = np.concatenate([pairs, pairs[:, ::-1]])
    sides = scipy.sparse.coo_array((ones, (ends[:, 0], ends[:, 1])), shape=(len(xy), len(xy)))
    neighbour = (sides.tocsr() > 0).astype(np.float64)
    near = np.zeros(len(xy), dtype=np.bool_)
    near[surface] = True
    for _ in range(DEPTH):
        near |= neighbour @ near > 0
    move = np.zeros_like(xy)
    move[surface] = place - xy[surface]
    given = ~near
    given[surface] = True
    mean = scipy.sparse.diags_array(1.0 / np.maximum(neighbour.sum(axis=1), 1.0)) @ neighbour
    for axis in range(2):
        free = ~(given | held[:, axis])
        if np.any(free):
            inner = mean[free]
            right = inner[:, ~free] @ move[~free, axis]
            matrix = (scipy.sparse.eye_array(free.sum()) - inner[:, free]).tocsc()
            move[free, axis] = scipy.sparse.linalg.spsolve(matrix, right)
    return xy + move
