"""The mesh: gridpoints and zones of a box or of a slope below a ground surface.

Zones are the cells of a regular net. A surface that runs along the diagonals of cells cuts them into triangles, so an inclined
face is straight. A triangle is a zone whose fourth gridpoint repeats its third.
"""

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
    """Mesh of `scene.grid` with the materials of `scene.material`; raises ValueError saying what would fit."""
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
        raise ValueError(f"{name} {extent:g} m is no whole number of zones of {size:g} m: use a zone size in {axis} of {fit:.10g}")
    return count


def _surface(profile, size, columns, rows):
    """Heights of the surface (in rows) at the left and right side of every column of cells, from the snapped profile."""
    at = np.rint(profile / np.asarray(size)).astype(int)
    if at[0, 0] != 0 or at[-1, 0] != columns:
        raise ValueError(f"profile must run from x = 0 to x = length, it runs from {profile[0, 0]:g} to {profile[-1, 0]:g} m")
    if np.any(at[:, 1] < 1) or np.any(at[:, 1] > rows):
        raise ValueError(f"profile must stay between one zone and the height of the grid, {rows * size[1]:g} m")
    left, right = np.zeros(columns, dtype=np.int64), np.zeros(columns, dtype=np.int64)
    for p, ((i0, j0), (i1, j1)) in enumerate(zip(at[:-1], at[1:], strict=True)):
        run, rise = i1 - i0, j1 - j0
        if run < 0:
            raise ValueError(f"profile goes back in x after its point {p}: overhangs cannot be meshed")
        if run and rise and run != abs(rise):
            raise ValueError(_misfit(profile[p], profile[p + 1], size))
        step = np.sign(rise) if run else 0
        left[i0:i1] = j0 + step * np.arange(run)
        right[i0:i1] = left[i0:i1] + step
    return left, right


def _misfit(a, b, size):
    dx, dy = abs(b - a)
    return (
        f"the face from ({a[0]:g}, {a[1]:g}) to ({b[0]:g}, {b[1]:g}) follows neither sides nor diagonals of zones of "
        f"{size[0]:g} x {size[1]:g} m: choose zone_size = [dx, dy] with dy/dx = {dy / dx:.6g}, for example "
        f"[{size[0]:.10g}, {size[0] * dy / dx:.10g}] or [{size[1] * dx / dy:.10g}, {size[1]:.10g}]"
    )


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
            f"{np.sum(index < 0)} zones have no material, one at ({x:g}, {y:g}): let the first material fill the grid "
            f"(no region) or widen the regions"
        )
    return index
