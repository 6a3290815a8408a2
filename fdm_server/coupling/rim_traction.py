"""Difference between the forces of the discs on a rim and the stress of the zones next to it."""

import numpy as np

from fdm_server.step.present_shape import present


def traction_difference(model, state, rim, stress):
    """Relative difference between the discs' forces and the stress of the zones next to the rim [-].

    At every rim gridpoint the traction P / l (l: half of both segments) is compared with sigma n of the adjoining zones
    (`stress` (A,4), area mean of the zones that share an edge with the rim there). Returns rms(difference) / rms(sigma n).
    """
    xy, K = present(model, state)[rim.nodes], len(rim.nodes)
    vector = np.roll(xy, -1, axis=0) - xy
    if rim.surface is not None:
        vector[-1] = 0.0  # no segment along the surface
    half = 0.5 * (np.linalg.norm(vector, axis=1) + np.linalg.norm(np.roll(vector, 1, axis=0), axis=1))
    normal = np.column_stack([-vector[:, 1], vector[:, 0]])  # times length, into the window: out of the grid
    zone = zones_behind(model, rim)
    s = stress[zone]
    push = np.column_stack([s[:, 0] * normal[:, 0] + s[:, 3] * normal[:, 1], s[:, 3] * normal[:, 0] + s[:, 1] * normal[:, 1]])
    expected = 0.5 * (push + np.roll(push, 1, axis=0)) / half[:, None]
    found = rim.force / half[:, None]
    size = np.sqrt(np.mean(np.sum(expected**2, axis=1)))
    return float(np.sqrt(np.mean(np.sum((found - expected) ** 2, axis=1))) / size) if K and size > 0 else 0.0


def zones_behind(model, rim):
    """Active zone on the outer side of every segment (K,); of an open rim any zone after its last node, where no segment is."""
    edges = {}
    for place, zone in enumerate(model.zones):
        corners = list(dict.fromkeys(zone.tolist()))
        for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
            edges[(a, b)] = place
    following = np.roll(rim.nodes, -1)
    found = [edges.get((b, a), -1) for a, b in zip(rim.nodes.tolist(), following.tolist(), strict=True)]
    if rim.surface is None and -1 in found:
        raise KeyError(int(rim.nodes[found.index(-1)]))
    return np.array(found)
