"""The mesh: gridpoints and zones of a box or of a slope below a ground surface.

Zones are the cells of a regular net. A surface that runs along the diagonals of cells cuts them into
triangles, so an inclined face is straight. A triangle is a zone whose fourth gridpoint repeats its third.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

SNAP = 1e-6  # share of a zone by which lengths may miss a whole number of zones


class Grid(NamedTuple):
    """N gridpoints, Z zones; zones row by row from the bottom, each row from left to right."""

    xy: NDArray[np.float64]  # (N,2) [m]
    zones: NDArray[np.int64]  # (Z,4) gridpoints, counter-clockwise; a triangle repeats its third
    column: NDArray[np.int64]  # (Z,) cell of the net in x, from 0
    row: NDArray[np.int64]  # (Z,) cell of the net in y, from 0
    material: NDArray[np.int64]  # (Z,) index into scene.material

    @property
    def triangular(self):
        """Which zones are triangles (Z,)."""
        return self.zones[:, 2] == self.zones[:, 3]


def build_grid(scene):
    """Mesh of `scene.grid` with its materials; raises ValueError saying what would fit."""
    g = scene.grid
    size = (g.zone_size, g.zone_size) if np.isscalar(g.zone_size) else tuple(g.zone_size)
    columns, rows = _whole(g.length, size[0], "length", "x"), _whole(g.height, size[1], "height", "y")
    profile = [(0.0, g.height), (g.length, g.height)] if g.kind == "box" else g.profile
    left, right = _surface(np.asarray(profile, dtype=np.float64), size, columns, rows)
    corners, column, row = _cells(left, right)
    used, zones = np.unique(corners, return_inverse=True)
    zones = zones.reshape(corners.shape).astype(np.int64)
    j, i = np.divmod(used, columns + 1)
    xy = np.column_stack([i * (g.length / columns), j * (g.height / rows)])
    return Grid(xy, zones, column, row, _materials(scene.material, centroids(xy, zones)))


def areas(xy, zones):
    """Area of each zone (Z,) [m2], positive when its gridpoints run counter-clockwise."""
    a, b = xy[zones[:, 2]] - xy[zones[:, 0]], xy[zones[:, 3]] - xy[zones[:, 1]]
    return 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def centroids(xy, zones):
    """Mean of each zone's distinct gridpoints (Z,2) [m]: its centroid for triangles and parallelograms."""
    weight = np.ones(zones.shape)
    weight[zones[:, 2] == zones[:, 3], 3] = 0.0
    return (xy[zones] * weight[:, :, None]).sum(axis=1) / weight.sum(axis=1)[:, None]


def _whole(extent, size, name, axis):
    count = round(extent / size)
    if count < 1 or abs(count * size - extent) > SNAP * extent:
        fit = extent / max(count, 1)
        raise ValueError(
            f"{name} {extent:g} m is no whole number of zones of {size:g} m: "
            f"use a zone size in {axis} of {fit:.10g}"
        )
    return count


def _surface(profile, size, columns, rows):
    """Heights (in rows) of the snapped surface at the left and the right side of every column of cells."""
    at = np.rint(profile / np.asarray(size)).astype(int)
    if at[0, 0] != 0 or at[-1, 0] != columns:
        raise ValueError(
            f"profile must run from x = 0 to x = length, it runs from {profile[0, 0]:g} to "
            f"{profile[-1, 0]:g} m"
        )
    if np.any(at[:, 1] < 1) or np.any(at[:, 1] > rows):
        raise ValueError(
            f"profile must stay between one zone and the height of the grid, {rows * size[1]:g} m"
        )
    left, right = np.zeros(columns, dtype=np.int64), np.zeros(columns, dtype=np.int64)
    for p, ((i0, j0), (i1, j1)) in enumerate(pairwise(at)):
        run, rise = i1 - i0, j1 - j0
        if run < 0:
            raise ValueError(f"profile goes back in x after its point {p}: overhangs cannot be meshed")
        if run and rise and run != abs(rise):
            raise ValueError(_misfit(profile, p, size, rows * size[1]))
        step = np.sign(rise) if run else 0
        left[i0:i1] = j0 + step * np.arange(run)
        right[i0:i1] = left[i0:i1] + step
    return left, right


def _misfit(profile, p, size, height):
    """What is wrong with the face after profile point p, and the nearest zone size that would fit."""
    (x0, y0), (x1, y1) = profile[p : p + 2]
    run, rise = abs(x1 - x0), abs(y1 - y0)
    counts = range(1, 4 * int(np.ceil(run / size[0])) + 1)
    fits = [
        n for n in counts if _divide(profile[:, 0], run / n) and _divide([*profile[:, 1], height], rise / n)
    ]
    remedy = f"choose zone_size = [dx, dy] with dy/dx = {rise / run:.6g}"
    if fits:
        n = min(fits, key=lambda n: abs(run / n - size[0]))
        remedy += f", for example [{run / n:.10g}, {rise / n:.10g}]"
    return (
        f"the face from ({x0:g}, {y0:g}) to ({x1:g}, {y1:g}) follows neither sides nor diagonals of zones of "
        f"{size[0]:g} x {size[1]:g} m: {remedy}"
    )


def _divide(lengths, size):
    """Whether all lengths are whole numbers of `size`."""
    counts = np.asarray(lengths) / size
    return bool(np.all(np.abs(counts - np.rint(counts)) < SNAP * np.maximum(counts, 1.0)))


def _cells(left, right):
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


def _materials(materials, centre):
    """Index of each zone's material: the last one whose region holds the zone's centre."""
    index = np.full(len(centre), -1, dtype=np.int64)
    for m, material in enumerate(materials):
        if material.region is None:
            index[:] = m
        else:
            index[shapely.contains_xy(shapely.Polygon(material.region), centre[:, 0], centre[:, 1])] = m
    if np.any(index < 0):
        x, y = centre[index < 0][0]
        raise ValueError(
            f"{np.sum(index < 0)} zones have no material, one at ({x:g}, {y:g}): let the first material "
            f"fill the grid (no region) or widen the regions"
        )
    return index
