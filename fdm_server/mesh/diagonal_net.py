"""A regular net of cells below a ground surface that runs along sides and diagonals of cells.

A diagonal cuts a cell into triangles, so an inclined face is straight. A triangle is a zone whose fourth gridpoint repeats its
third.
"""

from itertools import pairwise

import numpy as np

from coupler_protocol.geometry import NOWHERE, spot, spot_on

SNAP = 1e-6  # largest deviation of a length from a whole number of zones, in zones


def net_mesh(g):
    """Gridpoints xy (N,2) [m], zones (Z,4), column and row (Z,) of the table [grid]; raises ValueError with a remedy."""
    size = (g.zone_size, g.zone_size) if np.isscalar(g.zone_size) else tuple(g.zone_size)
    columns, rows = _whole(g.length, size[0], "length", "x"), _whole(g.height, size[1], "height", "y")
    profile = [(0.0, g.height), (g.length, g.height)] if g.kind == "box" else g.profile
    profile = np.asarray(profile, dtype=np.float64)
    check_extent(profile, g, size, miss=0.5)
    left, right = _surface(profile, size, columns, rows, g.origin or NOWHERE)
    corners, column, row = cells_below(left, right)
    used, zones = renumbered(corners)
    j, i = np.divmod(used, columns + 1)
    return np.column_stack([i * (g.length / columns), j * (g.height / rows)]), zones, column, row


def check_extent(profile, g, size, miss=SNAP):
    """Raise ValueError, saying what would fit, where a profile (P,2) does not run over the grid or leaves less than a zone.

    profile: counted from the origin of the table `g` [grid]; size: of a zone in x and y [m]; miss: share of a zone by which the
    profile may miss.
    """
    (x, y), (width, height), (left, bottom) = profile.T, size, g.origin or NOWHERE
    if abs(x[0]) > miss * width or abs(x[-1] - g.length) > miss * width:
        first, last = spot_on(x[0], left, 10), spot_on(x[-1], left, 10)
        why = f"profile must run from x = {left:.12g} over the length ({g.length:g} m), it runs from {first} to {last} m"
        remedy = f"use length = {x[-1]:.10g}"
        if abs(x[0]) > miss * width:
            remedy = f"use origin = [{first}, {bottom:.12g}] and length = {x[-1] - x[0]:.10g}"
        raise ValueError(f"{why}: {remedy}")
    if y.max() > g.height + max(miss, SNAP) * height:
        remedy = f"use height = {y.max():g}"
        if y.min() > height:
            relief = np.ptp(y)
            remedy += f", or a height of more than {relief:g} m with origin = [{left:.12g}, y of the bottom]"
        raise ValueError(
            f"profile reaches {spot_on(y.max(), bottom)} m, above the height of the grid ({g.height:g} m from "
            f"y = {bottom:.12g}): {remedy}"
        )
    if y.min() <= height * (1.0 - miss):
        at = int(y.argmin())
        raise ValueError(
            f"profile must leave at least one zone ({height:g} m) of ground, it leaves {y[at]:g} m at "
            f"x = {spot_on(x[at], left)} m: for rock at the level of the toe, draw a row of rock (add {height:g} m to height "
            f"and to every y of the scene, and give a strong material top = [[{left:.12g}, {spot_on(y[at] + height, bottom)}]])"
        )


def renumbered(corners):
    """Numbers (N,) in the whole net of the gridpoints that zones use, and the zones (Z,4) with the new numbers."""
    used, zones = np.unique(corners, return_inverse=True)
    return used, zones.reshape(corners.shape).astype(np.int64)


def _whole(extent, size, name, axis):
    count = round(extent / size)
    if count < 1 or abs(count * size - extent) > SNAP * extent:
        fit = extent / max(count, 1)
        raise ValueError(
            f"{name} ({extent:g} m) is not a whole multiple of the zone size ({size:g} m): "
            f"use a zone size in {axis} of {fit:.10g} m"
        )
    return count


def _surface(profile, size, columns, rows, origin):
    """Heights (in rows) of the fitted surface at the left and the right side of every column of cells."""
    at = np.rint(profile / np.asarray(size)).astype(int)
    left, right = np.zeros(columns, dtype=np.int64), np.zeros(columns, dtype=np.int64)
    for p, ((i0, j0), (i1, j1)) in enumerate(pairwise(at)):
        run, rise = i1 - i0, j1 - j0
        if run < 0:
            raise ValueError(f"profile turns back in x after its point {p}: overhangs cannot be meshed")
        if run and rise and run != abs(rise):
            raise ValueError(_misfit(profile, p, size, rows * size[1], origin))
        step = np.sign(rise) if run else 0
        left[i0:i1] = j0 + step * np.arange(run)
        right[i0:i1] = left[i0:i1] + step
    return left, right


def _misfit(profile, p, size, height, origin):
    """Problem of the face after profile point p, with the nearest zone size that fits."""
    (x0, y0), (x1, y1) = profile[p : p + 2]
    run, rise = abs(x1 - x0), abs(y1 - y0)
    counts = range(1, 4 * int(np.ceil(run / size[0])) + 1)
    fits = [n for n in counts if _divide(profile[:, 0], run / n) and _divide([*profile[:, 1], height], rise / n)]
    remedy = f"choose zone_size = [dx, dy] with dy/dx = {rise / run:.6g}"
    if fits:
        n = min(fits, key=lambda n: abs(run / n - size[0]))
        remedy += f", for example [{run / n:.10g}, {rise / n:.10g}]"
    return (
        f"the face from {spot((x0, y0), origin, 6)} to {spot((x1, y1), origin, 6)} follows neither sides nor diagonals of zones "
        f"of {size[0]:g} x {size[1]:g} m: {remedy}"
    )


def _divide(lengths, size):
    """Whether all lengths are whole numbers of `size`."""
    counts = np.asarray(lengths) / size
    return bool(np.all(np.abs(counts - np.rint(counts)) < SNAP * np.maximum(counts, 1.0)))


def cells_below(left, right):
    """Corners (Z,4) in the numbering of the whole net, column and row of the cells below the surface."""
    columns = len(left)
    zones = []
    for row in range(max(left.max(), right.max())):
        for column in range(columns):
            a = row * (columns + 1) + column
            b, c, d = a + 1, a + columns + 2, a + columns + 1
            below = (row < left[column], row < right[column])
            if below == (True, True):
                zones.append((a, b, c, d, column, row))
            elif below == (False, True):
                zones.append((a, b, c, c, column, row))
            elif below == (True, False):
                zones.append((a, b, d, d, column, row))
    table = np.array(zones, dtype=np.int64)
    return table[:, :4], table[:, 4].copy(), table[:, 5].copy()
