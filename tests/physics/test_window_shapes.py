"""The interface of windows of any shape: corners, staircases and oblique sides lose no force, moment, power or area."""

import numpy as np
import pytest
import scipy.linalg
from grid_cases import slope, window

from coupler_protocol.criteria.stable_step import stiffness_matrix
from coupler_protocol.geometry import polygon_area, segment_vectors
from coupler_protocol.interface.mapping import forces_to_nodes, velocities_to_discs
from coupler_protocol.interface.ring import build_ring, inner_share
from coupler_protocol.scene.tables.grid import Grid
from dem_server.coupling.rim import Rim
from dem_server.coupling.ring_guard import outside
from dem_server.model import build_model
from dem_server.observe.stable_limit import springs_of
from dem_server.packing.packing import pack
from dem_server.step.contact_pass import contact_forces
from fdm_server.mesh.grid import build_grid
from fdm_server.mesh.window_zones import rim_of, window_zones
from tests.dem_server.window_case import soil_discs
from tests.window_scenes import BOX, CIRCLE, L_SHAPE, RING, SECTOR

TOE = {"zone_size": 2 / 3, "profile": [(0.0, 4.0), (3.0, 4.0), (13.0, 12.0), (20.0, 12.0)], "fit": "face"}
WEDGE = [(4.9, 2.0), (13.2, 2.0), (12.2, 4.0), (15.5, 6.6), (12.0, 6.6), (5.3, 3.95)]
SHAPES = ("L", "circle", "sector", "slope")


def rim(shape):
    """Nodes (K, 2) of a rim in a grid: L and circle of square zones, a sector of a ring, and a window at a slope's toe."""
    if shape == "slope":
        grid, polygon = build_grid(slope(**TOE)), WEDGE
    else:
        table, polygon = {"L": (BOX, L_SHAPE), "circle": (BOX, CIRCLE), "sector": (RING, SECTOR)}[shape]
        case = slope()
        case.grid = Grid(**table)
        grid = build_grid(case)
    return grid.xy[rim_of(grid, window_zones(grid, window(None, None, polygon)))]


def cross(a, b):
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


@pytest.fixture(scope="module", params=SHAPES)
def nodes(request):
    return rim(request.param)


def test_uniform_stress_reaches_the_nodes_of_any_rim_exactly(nodes):
    """Each disc carries the traction of its arc of the rim: every node gets sigma n over half of both its segments."""
    ring = build_ring(nodes, 0.05)
    vector = segment_vectors(nodes)
    inward = np.column_stack([-vector[:, 1], vector[:, 0]]) @ [[-120e3, 30e3], [30e3, -200e3]]  # sigma n l of each segment
    half = 0.5 / np.maximum(2, np.rint(np.hypot(*vector.T) / 0.1))[:, None]  # of a segment: a disc's arc to either side
    before, after = ring.seg0, np.where(ring.node >= 0, ring.seg1, ring.seg0)
    P = (inward * half)[before] + (inward * half)[after]
    F = np.empty_like(nodes)
    forces_to_nodes(nodes, before, ring.seg1, ring.w0, ring.node, ring.xy, P, np.zeros(len(P)), F, False)
    np.testing.assert_allclose(F, 0.5 * (inward + np.roll(inward, 1, axis=0)), rtol=0, atol=1e-12 * np.abs(inward).max())


def test_force_moment_and_power_cross_any_rim_without_loss(nodes):
    rng = np.random.default_rng(1)
    ring = build_ring(nodes, 0.05)
    R, where = len(ring.radius), (ring.seg0, ring.seg1, ring.w0, ring.node)
    xd = ring.xy + rng.uniform(-0.01, 0.01, (R, 2))
    P, Mp, v = rng.standard_normal((R, 2)), 0.05 * rng.standard_normal(R), rng.standard_normal(nodes.shape)
    vd, spin, F = np.empty((R, 2)), np.empty(R), np.empty_like(nodes)
    velocities_to_discs(nodes, v, *where, xd, vd, spin, False)
    forces_to_nodes(nodes, *where, xd, P, Mp, F, False)
    np.testing.assert_allclose(F.sum(axis=0), P.sum(axis=0), rtol=0, atol=1e-13 * np.abs(P).sum())
    moments = np.abs(cross(nodes, F)).sum()
    assert abs(cross(nodes, F).sum() - cross(xd, P).sum() - Mp.sum()) < 1e-13 * moments
    power = (P * vd).sum() + (Mp * spin).sum()
    assert abs((F * v).sum() - power) < 1e-13 * (np.abs(F * v).sum() + np.abs(P * vd).sum() + np.abs(Mp * spin).sum())


def test_inner_shares_are_the_angles_of_the_rim(nodes):
    """Angles inside a polygon with R corners add up to (R - 2) pi; control discs between nodes have half a disc inside."""
    ring = build_ring(nodes, 0.05)
    share = inner_share(ring.xy)
    assert share.sum() == pytest.approx(0.5 * (len(share) - 2), rel=1e-12)
    np.testing.assert_allclose(share[ring.node < 0], 0.5, rtol=1e-9)
    assert share[ring.node >= 0].max() > 0.51  # every one of these rims has a re-entrant corner


@pytest.fixture(scope="module", params=[("L", "relaxed"), ("L", "inward"), ("sector", "relaxed"), ("sector", "inward")])
def packed(request):
    """Model, state and rim of a packed window."""
    shape, packing = request.param
    nodes, discs = rim(shape), soil_discs(0.08, packing=packing)
    ring = build_ring(nodes, discs.radius)
    found = pack(nodes, ring.xy, ring.radius, discs, np.random.default_rng(1))
    model, state = build_model(ring.xy, ring.radius, found, discs)
    contact_forces(model, state)
    return model, state, Rim(ring, "work-consistent")


def test_packed_windows_press_on_their_rim_with_what_their_contacts_carry(packed):
    """No disc outside; the rim's forces have the sum and the mean stress of those on the ring, for its discs lie on the line."""
    model, state, side = packed
    force, ring, inner = side.nodal_forces(state), model.ring, polygon_area(side.nodes)
    np.testing.assert_allclose(force.sum(axis=0), state.force[:ring].sum(axis=0), rtol=0, atol=1e-12 * np.abs(force).sum())
    pressure = (force * side.nodes).sum() / (2.0 * inner)
    assert pressure == pytest.approx((state.force[:ring] * state.x[:ring]).sum() / (2.0 * inner), rel=1e-9)
    assert pressure == pytest.approx(100e3, rel=0.03)
    assert not outside(state.x[:ring].copy(), state.disc, ring).any()


def test_discs_and_nodes_see_the_same_power(packed):
    _, state, side = packed
    velocity = 1e-9 * np.random.default_rng(2).standard_normal(side.nodes.shape)
    power = side.nodal_forces(state) * velocity
    side.move(state, velocity)
    assert side.power(state) == pytest.approx(power.sum(), abs=1e-12 * np.abs(power).sum())


def test_the_mass_rule_bounds_every_frequency_of_the_springs_on_a_rim(packed):
    """Springs of all the ring's contacts, their other ends held: omega^2 <= 1 with the masses of the rule alone."""
    model, state, side = packed
    free = 2 * len(side.nodes)
    K = stiffness_matrix(springs_of(model, state, side, listed=True)).toarray()[:free, :free]
    highest = scipy.linalg.eigvalsh(K, np.diag(np.repeat(side.stiffness_sums(model, state), 2)))[-1]
    assert 0.5 < highest <= 1.0 + 1e-12
