"""Blocks of 16 zones, the memory layout of the kernels.

Values of zones are stored as (B, 16 R): B blocks, each of R rows (corners, triangles, components) of 16 zones
side by side, so that an operation on a row is a few vector instructions. Row and lane share one index, `row *
LANES + lane`, so the distance between rows is constant for the compiler, which needs this to vectorise (four
times faster than a separate index for rows). Empty lanes at the end of the last block repeat gridpoint 0 and
have no area.

Every zone consists of two overlaid pairs of constant-strain triangles (Marti & Cundall 1982): corners (0,1,2),
(0,2,3) and (0,1,3), (1,2,3). In a triangular zone two of the four have no area.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

LANES = 16
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3], [0, 1, 3], [1, 2, 3]])


class Gather(NamedTuple):
    """Corner forces whose sum is the force on each of N gridpoints, and the order of gridpoints."""

    order: NDArray[np.uint32]  # (N,) gridpoints in the order in which they are summed
    ready: NDArray[np.uint32]  # (S+2,) order[ready[s]:ready[s + 1]] are summed after strip s; s = S: the seam between threads
    start: NDArray[np.uint32]  # (N+1,) forces on gridpoint n are at place[start[n]:start[n + 1]]
    place: NDArray[np.uint32]  # (M,)


class Geometry(NamedTuple):
    """Shape of the zones, B blocks."""

    corner: NDArray[np.uint32]  # (B,4 rows) gridpoint at each corner
    x: NDArray[np.float64]  # (B,4 rows) [m]
    y: NDArray[np.float64]  # (B,4 rows) [m]
    inverse_double_area: NDArray[np.float64]  # (B,5 rows) [1/m2] 1/(2A) of the four triangles and of the zone; 0 where A = 0
    share: NDArray[np.float64]  # (B,4 rows) [-] area of a triangle in its pair


def to_blocks(values):
    """Blocks (B, 16 R) of values by zone (Z,R); empty lanes are zero."""
    zones, R = values.shape
    blocks = -(-zones // LANES)
    padded = np.zeros((blocks * LANES, R), dtype=values.dtype)
    padded[:zones] = values
    return np.ascontiguousarray(padded.reshape(blocks, LANES, R).transpose(0, 2, 1)).reshape(blocks, R * LANES)


def from_blocks(blocks, zones):
    """Values by zone (Z,R) of blocks (B, 16 R)."""
    rows = blocks.reshape(len(blocks), -1, LANES).transpose(0, 2, 1)
    return np.ascontiguousarray(rows.reshape(-1, rows.shape[2])[:zones])


def new_history(history, points, blocks):
    """Zeros for a declared history: (N,) or (N,C) at N gridpoints, or (B, 16 C) in B blocks of zones."""
    if history.place == "zone":
        return np.zeros((blocks, history.components * LANES), dtype=history.dtype)
    return np.zeros(points if history.components == 1 else (points, history.components), dtype=history.dtype)


def triangle_double_areas(xy, zones):
    """Twice the areas of the zones' triangles (Z,4) [m2], exactly zero for the two missing ones of a triangular zone."""
    a, b, c = (xy[zones[:, TRIANGLES[:, k]]] for k in range(3))
    r1, r2 = b - a, c - a
    return r1[..., 0] * r2[..., 1] - r1[..., 1] * r2[..., 0]


def build_geometry(xy, zones):
    """Blocks of the shapes of `zones` (Z,4) with gridpoints at `xy` (N,2) [m]."""
    double = triangle_double_areas(xy, zones)
    whole = double[:, 0] + double[:, 1]
    all_five = np.column_stack([double, whole])
    inverse = np.divide(1.0, all_five, out=np.zeros_like(all_five), where=all_five > 0.0)
    return Geometry(
        corner=to_blocks(zones.astype(np.uint32)),
        x=to_blocks(xy[zones, 0]),
        y=to_blocks(xy[zones, 1]),
        inverse_double_area=to_blocks(inverse),
        share=to_blocks(double / whole[:, None]),
    )


def build_gather(zones, points):
    """Positions of the forces on each gridpoint: (start (N+1,), place (M,)) into blocks of corner forces.

    Corner forces have 8 rows: x at the four corners, then y. `place` is the flat position of an x component, in the order of
    zones and corners; sums in this order have the same bits in every run. Places are unsigned: for a signed index numba tests at
    every access whether it is negative, which makes the sum twice as slow.
    """
    zone, corner = np.divmod(np.arange(zones.size), 4)
    block, lane = np.divmod(zone, LANES)
    place = (block * 8 + corner) * LANES + lane
    point = zones.ravel()
    order = np.argsort(point, kind="stable")
    start = np.concatenate([[0], np.cumsum(np.bincount(point, minlength=points))])
    return start.astype(np.uint32), place[order].astype(np.uint32)
