"""The mapping conserves force, moment and power for discs anywhere, on any oblique loop; the paper's is mended."""

import numpy as np
import pytest

from coupler_protocol.interface import mapping
from coupler_protocol.interface import ring as interface


def oblique_loop(rng, K):
    """A star-shaped closed loop, counter-clockwise, with segments in all directions and of very different lengths."""
    angle = np.sort(rng.uniform(0, 2 * np.pi, K) * 0.2 + np.arange(K) * 2 * np.pi / K * 0.8)
    radius = rng.uniform(0.5, 2.0, K)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1) + rng.uniform(-50, 50, 2)


def scattered_discs(rng, nodes, n):
    """n discs off the line, some on nodes, as the arrays the mapping reads."""
    K = len(nodes)
    seg1 = rng.integers(0, K, n)
    on_node = rng.random(n) < 0.3
    seg0 = np.where(on_node, (seg1 - 1) % K, seg1)
    node = np.where(on_node, seg1, -1)
    w0 = np.where(on_node, rng.random(n), 1.0)
    vector = interface.segment_vectors(nodes)[seg1]
    xi = np.where(on_node, 0.0, rng.uniform(-0.2, 1.2, n))
    xd = nodes[seg1] + xi[:, None] * vector + rng.uniform(-0.5, 0.5, (n, 2))
    return seg0, seg1, w0, node, xd


def cross(a, b):
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


@pytest.mark.parametrize("seed", range(20))
def test_force_moment_and_power_are_conserved_at_any_angle(seed):
    rng = np.random.default_rng(seed)
    nodes = oblique_loop(rng, 12)
    n = 5000
    seg0, seg1, w0, node, xd = scattered_discs(rng, nodes, n)
    P = rng.standard_normal((n, 2))
    Mp = rng.standard_normal(n)
    v = rng.standard_normal((len(nodes), 2))
    vd, spin, F = np.empty((n, 2)), np.empty(n), np.empty_like(nodes)
    mapping.velocities_to_discs(nodes, v, seg0, seg1, w0, node, xd, vd, spin, False)
    mapping.forces_to_nodes(nodes, seg0, seg1, w0, node, xd, P, Mp, F, False)

    size = np.abs(P).sum()
    assert np.abs(F.sum(axis=0) - P.sum(axis=0)).max() <= 1e-13 * size
    centre = nodes.mean(axis=0)
    moment = cross(nodes - centre, F).sum() - cross(xd - centre, P).sum() - Mp.sum()
    assert abs(moment) <= 1e-13 * (np.abs(cross(xd - centre, P)).sum() + np.abs(Mp).sum() + np.abs(F).sum() * 4)
    power = (F * v).sum() - (P * vd).sum() - (Mp * spin).sum()
    assert abs(power) <= 1e-13 * (np.abs(P * vd).sum() + np.abs(Mp * spin).sum() + np.abs(F * v).sum())


def test_single_discs_one_by_one():
    rng = np.random.default_rng(1)
    for _ in range(300):
        nodes = oblique_loop(rng, 5)
        seg0, seg1, w0, node, xd = scattered_discs(rng, nodes, 1)
        P, Mp = rng.standard_normal((1, 2)), rng.standard_normal(1)
        v = rng.standard_normal((5, 2))
        vd, spin, F = np.empty((1, 2)), np.empty(1), np.empty((5, 2))
        mapping.velocities_to_discs(nodes, v, seg0, seg1, w0, node, xd, vd, spin, False)
        mapping.forces_to_nodes(nodes, seg0, seg1, w0, node, xd, P, Mp, F, False)
        scale = np.abs(F).max() * max(np.abs(v).max(), 1.0) + 1.0
        assert (F * v).sum() == pytest.approx((P * vd).sum() + Mp[0] * spin[0], abs=1e-12 * scale)


def test_rigid_motion_is_reproduced():
    rng = np.random.default_rng(2)
    nodes = oblique_loop(rng, 9)
    n = 400
    seg0, seg1, w0, node, xd = scattered_discs(rng, nodes, n)
    omega, shift = 0.7, np.array([0.3, -0.2])
    v = shift + omega * np.stack([-nodes[:, 1], nodes[:, 0]], axis=1)
    vd, spin = np.empty((n, 2)), np.empty(n)
    mapping.velocities_to_discs(nodes, v, seg0, seg1, w0, node, xd, vd, spin, False)
    expected = shift + omega * np.stack([-xd[:, 1], xd[:, 0]], axis=1)
    np.testing.assert_allclose(vd, expected, atol=1e-11)
    np.testing.assert_allclose(spin, omega, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("degrees", [0, 5, 30, 45, 77, 90])
def test_mended_paper_mapping_keeps_the_force_where_the_printed_one_loses_it(degrees):
    turn = np.radians(degrees)
    t = np.array([np.cos(turn), np.sin(turn)])
    nodes = np.array([[0.0, 0.0], t, t + np.array([-t[1], t[0]]), [-t[1], t[0]]])
    xd = (0.3 * t)[None, :]
    P = np.array([[0.4, -1.1]])
    one = np.zeros(1, dtype=np.int64)
    F = np.empty((4, 2))
    mapping.forces_to_nodes(nodes, one, one, np.ones(1), one - 1, xd, P, np.zeros(1), F, True)
    np.testing.assert_allclose(F.sum(axis=0), P[0], atol=1e-14)
    moment = nodes[1, 0] * F[1, 1] - nodes[1, 1] * F[1, 0]
    assert moment == pytest.approx(xd[0, 0] * P[0, 1] - xd[0, 1] * P[0, 0], abs=1e-14)

    # Equation (10), line 2 as printed, for comparison: it loses force on oblique segments only.
    r, r1 = 0.3, 0.7
    m3 = xd[0, 0] * P[0, 1] - xd[0, 1] * P[0, 0]
    m0 = r1 / (r + r1) * (P[0] @ t)
    m1 = P[0] @ np.array([-t[1], t[0]]) - m3
    if abs(t[1]) < 0.1:
        m2 = (P[0, 0] + (m1 + m3) * t[1] - m0 * t[0]) / t[0]
    else:
        m2 = (P[0, 1] + (m1 + m3) * t[0] - m0 * t[1]) / t[1]
    lost = abs((m0 + m2) - P[0] @ t)
    assert (lost > 0.05) == (degrees in (30, 45, 77))


def test_ring_of_the_paper_window():
    side = 1.0 / 3.0
    x = np.arange(6) * side
    y = np.arange(17) * side
    rim = np.concatenate(
        [
            np.stack([x, 0 * x], axis=1),
            np.stack([0 * y + 6 * side, y], axis=1),
            np.stack([6 * side - x, 0 * x + 17 * side], axis=1),
            np.stack([0 * y, 17 * side - y], axis=1),
        ]
    )
    ring = interface.build_ring(rim, 0.03)
    assert len(rim) == 46
    assert len(ring.radius) == 276
    np.testing.assert_allclose(ring.radius, side / 12, rtol=1e-12)
    gap = np.linalg.norm(np.roll(ring.xy, -1, axis=0) - ring.xy, axis=1) - ring.radius - np.roll(ring.radius, -1)
    assert np.abs(gap).max() < 1e-12
    assert ring.arc.sum() == pytest.approx(2 * (6 + 17) * side)


def test_uniform_stress_reaches_the_nodes_exactly_on_an_oblique_rim():
    """sigma.n integrated over each disc's arc and mapped gives sigma.n l/2 of both segments at every node."""
    turn = np.radians(31.0)
    Q = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    square = np.array([[0, 0], [1, 0], [2, 0], [2, 1], [2, 2], [1, 2], [0, 2], [0, 1]], dtype=float) @ Q.T
    ring = interface.build_ring(square, 0.11)
    sigma = np.array([[-3.0, 0.7], [0.7, -5.0]])
    vector = interface.segment_vectors(square)
    normal = np.stack([vector[:, 1], -vector[:, 0]], axis=1)
    traction = normal @ sigma / np.linalg.norm(vector, axis=1)[:, None]
    half = ring.arc[:, None] / 2
    P = half * traction[ring.seg0] + half * traction[ring.seg1]
    F = np.empty_like(square)
    mapping.forces_to_nodes(square, ring.seg0, ring.seg1, ring.w0, ring.node, ring.xy, P, np.zeros(len(P)), F, False)
    whole = normal @ sigma / 2
    np.testing.assert_allclose(F, whole + np.roll(whole, 1, axis=0), atol=1e-12)


@pytest.mark.parametrize(
    ("nodes", "reason"),
    [
        ([[0, 0], [1, 0], [1, 0], [0, 1]], "zero length"),
        ([[0, 0], [0, 1], [1, 0]], "counter-clockwise"),
        ([[0, 0], [1, 0]], "at least 3"),
    ],
)
def test_bad_loops_are_refused(nodes, reason):
    with pytest.raises(ValueError, match=reason):
        interface.build_ring(np.array(nodes, dtype=float), 0.05)


# -- open rims ---------------------------------------------------------------------------------------------------------------


def open_ring(degrees, radius=0.11, surface=((1.0, 2.2),)):
    """Ring of an open rim, turned by `degrees`: down from the surface, along the bottom and up to the surface on the right."""
    turn = np.radians(degrees)
    Q = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    chain = np.array([[0.0, 2.0], [0.0, 1.4], [0.1, 0.0], [1.0, 0.0], [2.0, 0.1], [2.0, 1.0], [2.1, 2.0]])
    return interface.build_ring(chain @ Q.T, radius, np.reshape(surface, (-1, 2)) @ Q.T)


@pytest.mark.parametrize("degrees", [0.0, 31.0, 117.0])
def test_an_open_rim_has_discs_on_all_of_its_segments_and_none_on_the_surface(degrees):
    ring = open_ring(degrees)
    length = np.hypot(*np.diff(ring.nodes, axis=0).T)
    assert ring.arc.sum() == pytest.approx(length.sum(), rel=1e-13)
    np.testing.assert_array_equal(ring.xy[[0, -1]], ring.nodes[[0, -1]])
    assert ring.node[[0, -1]].tolist() == [0, len(ring.nodes) - 1]
    assert max(ring.seg0.max(), ring.seg1.max()) == len(ring.nodes) - 2
    apart = np.hypot(*np.diff(ring.xy, axis=0).T) - ring.radius[1:] - ring.radius[:-1]
    between = (ring.node[1:] < 0) & (ring.node[:-1] < 0)
    assert np.abs(apart[between]).max() < 1e-12
    assert apart.min() > -1e-12
    assert len(ring.outline) == len(ring.nodes) + 1
    assert interface.polygon_area(ring.outline) == pytest.approx(4.0 - 0.1 + 0.155, abs=0.2)


@pytest.mark.parametrize("degrees", [0.0, 31.0, 117.0])
@pytest.mark.parametrize("seed", range(5))
def test_an_open_rim_conserves_force_moment_and_power(degrees, seed):
    rng = np.random.default_rng(seed)
    ring = open_ring(degrees)
    where = (ring.seg0, ring.seg1, ring.w0, ring.node)
    xd = ring.xy + rng.uniform(-0.05, 0.05, ring.xy.shape)  # as after large strain
    P, Mp, v = rng.standard_normal(xd.shape), rng.standard_normal(len(xd)), rng.standard_normal(ring.nodes.shape)
    vd, spin, F = np.empty_like(xd), np.empty(len(xd)), np.empty_like(ring.nodes)
    mapping.velocities_to_discs(ring.nodes, v, *where, xd, vd, spin, False)
    mapping.forces_to_nodes(ring.nodes, *where, xd, P, Mp, F, False)
    np.testing.assert_allclose(F.sum(axis=0), P.sum(axis=0), atol=1e-12)
    assert cross(ring.nodes, F).sum() == pytest.approx(cross(xd, P).sum() + Mp.sum(), abs=1e-11)
    assert (F * v).sum() == pytest.approx((P * vd).sum() + (Mp * spin).sum(), abs=1e-11)


def test_the_ends_of_an_open_rim_turn_with_their_own_segment():
    """A motion of one end node does not reach the other end: nothing goes across the surface."""
    ring = open_ring(31.0)
    v, vd, spin = np.zeros_like(ring.nodes), np.empty_like(ring.xy), np.empty(len(ring.xy))
    v[0] = [0.3, -0.2]
    mapping.velocities_to_discs(ring.nodes, v, ring.seg0, ring.seg1, ring.w0, ring.node, ring.xy, vd, spin, False)
    moved = (vd != 0.0).any(axis=1) | (spin != 0.0)
    assert moved[0]
    assert not moved[ring.seg0 > 0].any()
    x, y = ring.nodes[1] - ring.nodes[0]
    assert spin[0] == pytest.approx((x * 0.2 + y * 0.3) / (x * x + y * y))


@pytest.mark.parametrize("degrees", [0.0, 31.0])
def test_uniform_stress_reaches_the_nodes_of_an_open_rim_exactly(degrees):
    """sigma.n l/2 of both segments of a node; the end nodes get that of their only segment."""
    ring = open_ring(degrees, radius=0.02)
    sigma = np.array([[-3.0, 0.7], [0.7, -5.0]])
    vector = np.diff(ring.nodes, axis=0)
    normal = np.stack([vector[:, 1], -vector[:, 0]], axis=1)
    traction = normal @ sigma / np.linalg.norm(vector, axis=1)[:, None]
    spacing = np.linalg.norm(vector, axis=1) / (1 + np.bincount(ring.seg0[ring.node < 0], minlength=len(vector)))
    P = np.zeros_like(ring.xy)
    ends = ring.node >= 0
    P[~ends] = (spacing[:, None] * traction)[ring.seg0[~ends]]
    for p in np.flatnonzero(ends):
        for segment in {int(ring.node[p]) - 1, int(ring.node[p])} & set(range(len(vector))):
            P[p] += 0.5 * spacing[segment] * traction[segment]
    F = np.empty_like(ring.nodes)
    mapping.forces_to_nodes(ring.nodes, ring.seg0, ring.seg1, ring.w0, ring.node, ring.xy, P, np.zeros(len(P)), F, False)
    half = normal @ sigma / 2
    expected = np.zeros_like(F)
    expected[:-1] += half
    expected[1:] += half
    np.testing.assert_allclose(F, expected, atol=1e-12)


def test_inner_shares_at_the_ends_of_an_open_rim_reach_to_the_surface():
    square = np.array([[0.0, 1.0], [0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    level = interface.inner_share(square, np.empty((0, 2)))
    np.testing.assert_allclose(level, 0.25)
    ridge = interface.inner_share(square, np.array([[0.5, 1.5]]))
    np.testing.assert_allclose(ridge, [0.375, 0.25, 0.25, 0.375])
