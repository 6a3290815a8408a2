"""Stress of zones without the pressure mode: means at gridpoints, then means over the corners of each zone.

A quadrilateral has one mean stress. In plastic flow at constant volume, a pattern of alternate signs (+ - + - from zone to zone)
exerts no force on the gridpoints between the zones, so equilibrium does not determine it (docs/theory.md). Alternate signs cancel
at each gridpoint that four zones share:

    at gridpoint n    s_n = sum w A sigma / sum w A     over the corners of zones that belong to n                (1)
    of a zone         S = sum w s_n                     over its corners, w: 1/4, in a triangular zone 1/3        (2)

Both together keep a uniform stress and the mean over the area of all zones; they keep a linear field where four zones of one size
meet. Near borders they move a linear field by a quarter of a zone. Corners are averaged together as in
coupler_protocol.geometry.corner_joints: not over the boundary of two materials, an excavation or a window.

Source: Sani, Gresho, Lee & Griffiths (1981), Int. J. Numer. Methods Fluids 1, 17-43 (the mode and its filters).
"""

import numpy as np

from coupler_protocol.geometry import CORNERS, corner_joints, corner_weights


def smoothed(xy: np.ndarray, corners: np.ndarray, material: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Means (Z, C) over corners, Eq (2), of values (Z, C) of zones.

    xy (N, 2) [m]: gridpoints; corners (Z, 4): those of each zone, the last one twice in a triangle; material (Z,).
    """
    joint, weight = corner_joints(corners, material), corner_weights(corners)
    share = weight * _areas(xy[corners])[:, None]
    whole = np.bincount(joint.ravel(), share.ravel())
    means = np.empty(values.shape)
    for column, value in enumerate(values.T):
        at_gridpoints = np.bincount(joint.ravel(), (share * value[:, None]).ravel()) / whole
        means[:, column] = np.sum(weight * at_gridpoints[joint], axis=1)
    return means


def pressure_mode(corners: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gridpoints (n,) that four quadrilaterals share, and the amplitude (n,) of alternate signs among them.

    values (Z,). With a, b, c, d in their order around the gridpoint: (a - b + c - d)/4, zero for a linear field on equal zones.
    """
    quads = np.flatnonzero(corners[:, 2] != corners[:, 3])
    point, zone = corners[quads].ravel(), np.repeat(quads, 4)
    before = np.roll(corners[quads], 1, axis=1).ravel()
    after = np.roll(corners[quads], -1, axis=1).ravel()
    order = np.argsort(point, kind="stable")
    point, zone, before, after = point[order], zone[order], before[order], after[order]
    found, start, count = np.unique(point, return_index=True, return_counts=True)
    four = start[count == 4][:, None] + CORNERS
    # around a gridpoint, the next zone begins with the side with which a zone ends
    opposite = ~((after[four] == before[four[:, :1]]) | (before[four] == after[four[:, :1]]))
    closed = opposite.sum(axis=1) == 2  # the first zone itself, and the one across
    signs = np.where(opposite[closed], 1.0, -1.0)
    return found[count == 4][closed], 0.25 * np.sum(signs * values[zone[four[closed]]], axis=1)


def _areas(corner: np.ndarray) -> np.ndarray:
    """Areas (Z,) [m2] of quadrilaterals (Z, 4, 2)."""
    across, along = corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1]
    return 0.5 * (across[:, 0] * along[:, 1] - across[:, 1] * along[:, 0])
