"""Zones, discs and contacts as VTK cells: connectivity, offsets, cell types, rows of fields.

A continuum is an UnstructuredGrid of quads and triangles. A discrete domain is PolyData: every disc is a
vertex, every contact a line between the centres of its discs.
"""

from collections.abc import Mapping

import numpy as np

TOPOLOGIES = {"continuum": "UnstructuredGrid", "discrete": "PolyData"}
TRIANGLE, QUAD = 5, 9  # VTK's numbers of cell types


def cell_groups(kind: str, points: np.ndarray, cells: np.ndarray) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """{prefix of a group in the file: (connectivity, offsets)} of the groups of cells."""
    if kind == "continuum":
        corners = np.where(is_triangle(cells), 3, 4)
        used = np.arange(4) < corners[:, None]
        return {"": (cells[used], np.concatenate(([0], np.cumsum(corners))))}
    nothing = (np.empty(0, np.int64), np.zeros(1, np.int64))
    return {
        "Vertices/": (np.arange(len(points)), np.arange(len(points) + 1)),
        "Lines/": (cells.ravel(), np.arange(0, 2 * len(cells) + 1, 2)),
        "Polygons/": nothing,
        "Strips/": nothing,
    }


def is_triangle(zones: np.ndarray) -> np.ndarray:
    """(Z,) whether a zone is a triangle: a quadrilateral whose last two gridpoints are the same."""
    return zones[:, 3] == zones[:, 2]


def zone_types(zones: np.ndarray) -> np.ndarray:
    """(Z,) VTK cell type of each zone."""
    return np.where(is_triangle(zones), TRIANGLE, QUAD).astype(np.uint8)


def cell_rows(kind: str, points: np.ndarray, fields: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Cell fields, one row a cell. VTK counts vertices first, so contact fields begin with empty rows."""
    if kind == "continuum":
        return dict(fields)
    rows = {}
    for name, values in fields.items():
        empty = np.nan if values.dtype.kind == "f" else -1
        rows[name] = np.concatenate((np.full((len(points), *values.shape[1:]), empty, values.dtype), values))
    return rows


def as_stored(values: np.ndarray) -> np.ndarray:
    """A copy in the types of the file: float64 or int32, plane vectors (n, 2) as VTK's (n, 3)."""
    values = np.asarray(values)
    stored = np.array(values, dtype=np.float64 if values.dtype.kind == "f" else np.int32, order="C")
    if stored.ndim == 2 and stored.shape[1] == 2:
        stored = np.column_stack((stored, np.zeros(len(stored), stored.dtype)))
    return stored
