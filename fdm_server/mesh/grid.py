"""The mesh: gridpoints and zones of a box, of a slope below a ground surface, or of a ring around a hole."""

from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from coupler_protocol.geometry import NOWHERE, spot
from fdm_server.mesh.diagonal_net import net_mesh
from fdm_server.mesh.face_net import along_face_mesh
from fdm_server.mesh.fitted_net import fitted_mesh
from fdm_server.mesh.hole_ring import ring_mesh


class Grid(NamedTuple):
    """N gridpoints, Z zones; zones row by row from the bottom, each row from left to right.

    In a ring rows are counted from the hole outwards, columns counter-clockwise from y = 0.
    """

    xy: NDArray[np.float64]  # (N,2) [m]
    zones: NDArray[np.int64]  # (Z,4) gridpoints, counter-clockwise; a triangle repeats its third
    column: NDArray[np.int64]  # (Z,) cell of the net in x, from 0
    row: NDArray[np.int64]  # (Z,) cell of the net in y, from 0
    material: NDArray[np.int64]  # (Z,) index into scene.material
    radii: tuple[float, float] | None = None  # [m] of the inner and the outer side of a ring
    origin: tuple[float, float] = NOWHERE  # [m] of the scene as drawn, from which xy counts (coupler_protocol.scene.local_origin)

    @property
    def triangular(self):
        """(Z,) whether a zone is a triangle."""
        return self.zones[:, 2] == self.zones[:, 3]


def build_grid(scene):
    """Mesh of `scene.grid` with its materials, for a local scene (coupler_protocol.scene.local_origin).

    Raises ValueError with a remedy.
    """
    g = scene.grid
    if g.kind == "ring":
        mesh = ring_mesh(g)
    elif g.regular:
        mesh = net_mesh(g)
    elif g.fit == "face":
        mesh = along_face_mesh(g, [m.top[0][1] for m in scene.material if m.top is not None and len({y for _, y in m.top}) == 1])
    else:
        mesh = fitted_mesh(g, [m.top for m in scene.material if m.top is not None])
    xy, zones, column, row = mesh
    radii = (g.inner, g.outer) if g.kind == "ring" else None
    origin = g.origin or NOWHERE
    return Grid(xy, zones, column, row, _materials(scene.material, centroids(xy, zones), origin), radii, origin)


def areas(xy, zones):
    """Area of each zone (Z,) [m2], positive when its gridpoints run counter-clockwise."""
    a, b = xy[zones[:, 2]] - xy[zones[:, 0]], xy[zones[:, 3]] - xy[zones[:, 1]]
    return 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def centroids(xy, zones):
    """Mean of each zone's distinct gridpoints (Z,2) [m]: its centroid for triangles and parallelograms."""
    weight = np.ones(zones.shape)
    weight[zones[:, 2] == zones[:, 3], 3] = 0.0
    return (xy[zones] * weight[:, :, None]).sum(axis=1) / weight.sum(axis=1)[:, None]


def chosen_zones(grid, table):
    """(Z,) whether a zone is in the columns and rows of a window or an excavation, or has its centre in the polygon."""
    if table.polygon is not None:
        x, y = centroids(grid.xy, grid.zones).T
        return shapely.contains_xy(shapely.Polygon(table.polygon), x, y)
    (c0, c1), (r0, r1) = table.columns, table.rows
    return (grid.column >= c0) & (grid.column <= c1) & (grid.row >= r0) & (grid.row <= r1)


def _levels(materials):
    """Heights [m] of the materials' level tops."""
    return [m.top[0][1] for m in materials if m.top is not None and len({y for _, y in m.top}) == 1]


def _materials(materials, centre, origin):
    """(Z,) index of each zone's material: the last one whose region or ground contains the zone's centre (Z,2) from `origin`."""
    index = np.full(len(centre), -1, dtype=np.int64)
    for m, material in enumerate(materials):
        inside = np.ones(len(centre), dtype=np.bool_)
        if material.region is not None:
            inside = shapely.contains_xy(shapely.Polygon(material.region), centre[:, 0], centre[:, 1])
        elif material.top is not None:
            inside = centre[:, 1] < np.interp(centre[:, 0], *np.transpose(material.top))
        index[inside] = m
    if np.any(index < 0):
        raise ValueError(
            f"{np.sum(index < 0)} zones have no material, one at {spot(centre[index < 0][0], origin, 6)}: let the first material "
            f"fill the grid (no region) or widen the regions"
        )
    return index
