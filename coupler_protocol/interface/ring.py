"""Geometry of the interface: the closed loop of segments and the ring of control discs on it.

The rim of a window is a closed chain of zone edges, counter-clockwise. Both sides describe it by K nodes and K segments (segment
i runs from node i to node i + 1). There is a control disc on every node, and k - 1 more on each segment. All centres are on the
line and discs touch: on equal segments of length l the radius is l / (2k) with k = round(l / 2R), at least 2. A uniform traction
is then mapped to the nodes exactly. Segments of different length have different k; a disc on a node has the smaller radius of
both segments, and its neighbours keep the spacing l / k.

A window that reaches the ground surface has an open rim: a chain of K nodes and K - 1 segments, from the surface around the
window back to the surface. There are no control discs on the surface. A disc on the first or last node moves as one between nodes
of its only segment: it has the spin of this segment, and its moment is the couple of this segment.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coupler_protocol.geometry import polygon_area, segment_vectors


class Ring(NamedTuple):
    """Control discs on the rim. K nodes, R discs, ordered along the loop.

    seg0, seg1, w0, node are arguments of `coupler_protocol.interface.mapping`: the segment of a disc (for a disc on a node the
    one before it), the segment after it, the share of seg0 in its spin, and its node or -1.
    """

    nodes: NDArray[np.float64]  # (K,2) [m] positions of the rim's nodes when the ring was made
    xy: NDArray[np.float64]  # (R,2) [m]
    radius: NDArray[np.float64]  # (R,) [m]
    seg0: NDArray[np.int64]  # (R,)
    seg1: NDArray[np.int64]  # (R,)
    w0: NDArray[np.float64]  # (R,)
    node: NDArray[np.int64]  # (R,)
    arc: NDArray[np.float64]  # (R,) [m] length of rim that belongs to each disc
    surface: NDArray[np.float64] | None = None  # (S,2) [m] of an open rim: ground surface between its last and first node

    @property
    def outline(self) -> NDArray[np.float64]:
        """Corners (P,2) [m] of the window: its nodes, and the points of the ground surface of an open rim."""
        return self.nodes if self.surface is None else np.concatenate([self.nodes, self.surface])


def build_ring(nodes: NDArray[np.float64], radius: float, surface: NDArray[np.float64] | None = None) -> Ring:
    """Control discs on the loop `nodes` (K,2) [m] for soil discs of mean radius `radius` [m].

    surface: of an open rim, as in Ring. Raises ValueError for a loop that is not counter-clockwise or has a zero segment.
    """
    nodes = np.ascontiguousarray(nodes, dtype=np.float64)
    is_open = surface is not None
    vector = segment_vectors(nodes)[: -1 if is_open else None]
    length = np.hypot(vector[:, 0], vector[:, 1])
    if len(nodes) < 3:
        raise ValueError(f"an interface needs at least 3 nodes, this one has {len(nodes)}")
    if np.any(length <= 1e-12 * np.max(np.abs(nodes))):
        raise ValueError(f"segment {int(np.argmin(length))} of the interface has zero length: merge its two nodes")
    if polygon_area(nodes if surface is None else np.concatenate([nodes, surface.reshape(-1, 2)])) <= 0.0:
        raise ValueError("the nodes of the interface must run counter-clockwise around the window")
    K = len(nodes)
    k = np.maximum(2, np.rint(length / (2.0 * radius)).astype(np.int64))
    r_seg = length / (2.0 * k)

    before, after = np.roll(np.arange(K), 1), np.arange(K)
    if is_open:
        before[0], after[-1] = 0, K - 2
    on_node = k.sum() + is_open  # discs between nodes are numbered in the same order; R = sum(k), of an open rim one more
    xy = np.empty((on_node, 2))
    r = np.empty(on_node)
    seg0, seg1, node = (np.empty(on_node, dtype=np.int64) for _ in range(3))
    w0 = np.ones(on_node)
    arc = np.empty(on_node)
    p = 0
    for i in range(K):
        xy[p] = nodes[i]
        a, b = before[i], after[i]
        r[p] = min(r_seg[a], r_seg[b])
        seg0[p], seg1[p], node[p] = a, b, i
        w0[p] = length[a] / (length[a] + length[b]) if a != b else 1.0
        arc[p] = r_seg[a] + r_seg[b] if a != b else r_seg[a]
        p += 1
        for j in range(1, k[i] if i < len(k) else 1):
            xy[p] = nodes[i] + vector[i] * (j / k[i])
            r[p] = r_seg[i]
            seg0[p] = seg1[p] = i
            node[p] = -1
            arc[p] = 2.0 * r_seg[i]
            p += 1
    return Ring(nodes, xy, r, seg0, seg1, w0, node, arc, None if surface is None else np.reshape(surface, (-1, 2)))


def inner_share(ring_xy: NDArray[np.float64], surface: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
    """Share (R,) of the area of each control disc inside the ring: the interior angle of the chain over a full turn.

    surface: of an open rim, as in Ring; the discs at its ends have the angle between the chain and the ground surface.
    """
    following, previous = np.roll(ring_xy, -1, axis=0), np.roll(ring_xy, 1, axis=0)
    if surface is not None and len(surface):
        following[-1], previous[0] = surface[0], surface[-1]
    ahead, back = following - ring_xy, previous - ring_xy
    cross = ahead[:, 0] * back[:, 1] - ahead[:, 1] * back[:, 0]
    return np.mod(np.arctan2(cross, (ahead * back).sum(axis=1)), 2.0 * np.pi) / (2.0 * np.pi)


def node_shares(ring: Ring) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Shares N (R,2) of a disc's force on the two nodes of its segment and their indices (R,2).

    The first node is the segment's first; a disc on a node has the shares 1 and 0.
    """
    K = len(ring.nodes)
    first = np.where(ring.node >= 0, ring.node, ring.seg0)
    index = np.stack([first, (first + 1) % K], axis=1)
    start = ring.nodes[ring.seg0]
    vector = segment_vectors(ring.nodes)[ring.seg0]
    xi = np.einsum("ij,ij->i", ring.xy - start, vector) / np.einsum("ij,ij->i", vector, vector)
    xi = np.where(ring.node >= 0, 0.0, xi)
    return np.stack([1.0 - xi, xi], axis=1), index
