"""Bounds and exact values of the highest frequency, without any server."""

import numpy as np
import pytest
import scipy.sparse

from coupler_protocol.criteria.stable_step import Springs, as_text, highest, limit, spring_sums, step, stiffness_matrix


def chain(masses, k=3.0):
    """Springs between bodies in a row along an oblique line."""
    count, (cx, cy) = masses - 1, (0.6, 0.8)
    first, second = np.zeros((count, 3 * masses)), np.zeros((count, 3 * masses))
    for c in range(count):
        first[c, 3 * c : 3 * c + 2] = -cx, -cy
        second[c, 3 * c + 3 : 3 * c + 5] = cx, cy
    return Springs(scipy.sparse.csr_array(first), scipy.sparse.csr_array(second), np.full(count, k), 0)


@pytest.mark.parametrize("masses", [2, 3, 40])
def test_free_chain(masses):
    """omega = 2 sqrt(k/m) cos(pi / 2N); the bound is that of the endless chain, for two masses that of their spring."""
    springs = chain(masses)
    omega2, mode = highest(stiffness_matrix(springs), np.full(3 * masses, 2.0))
    assert omega2 == pytest.approx(4.0 * 3.0 / 2.0 * np.cos(np.pi / (2 * masses)) ** 2, rel=1e-9)
    assert mode @ (2.0 * mode) == pytest.approx(1.0, rel=1e-9)
    assert spring_sums(springs).bodies.max() == pytest.approx(12.0 if masses > 2 else 6.0, rel=1e-12)


@pytest.mark.parametrize("seed", range(20))
def test_no_frequency_is_beyond_the_bound(seed):
    """Springs of any direction and lever between nodes and bodies: each block with the mass of its sum has omega^2 <= 1."""
    rng = np.random.default_rng(seed)
    nodes, bodies, count = 6, 5, 12
    first, second = np.zeros((count, 2 * nodes + 3 * bodies)), np.zeros((count, 2 * nodes + 3 * bodies))
    for c in range(count):
        body = 2 * nodes + 3 * rng.choice(bodies, 2, replace=False)
        second[c, body[0] : body[0] + 3] = rng.standard_normal(3) * [1, 1, c % 2]
        if c % 3:
            near = rng.choice(nodes, 3, replace=False)
            first[c, np.concatenate([2 * near, 2 * near + 1])] = rng.standard_normal(6)
        else:
            first[c, body[1] : body[1] + 3] = rng.standard_normal(3)
    springs = Springs(*map(scipy.sparse.csr_array, (first, second)), 10.0 ** rng.uniform(-2, 2, count), nodes)
    sums = spring_sums(springs)
    turning = np.column_stack([sums.bodies, sums.bodies, sums.rotations])
    mass = np.concatenate([np.repeat(sums.nodes, 2), turning.ravel()])
    K = stiffness_matrix(springs)
    mass[mass == 0.0] = np.inf
    assert 0.2 < highest(K, mass)[0] < 1.0 + 1e-12
    scale = mass**-0.5
    assert highest(K, mass)[0] == pytest.approx(np.linalg.eigvalsh(K.toarray() * scale * scale[:, None])[-1], rel=1e-9)


def test_held_components_do_not_move():
    omega2, mode = highest(stiffness_matrix(chain(2)), np.repeat([np.inf, 2.0], 3))
    assert omega2 == pytest.approx(3.0 / 2.0)
    assert not mode[:3].any()


def test_damping_shortens_the_step():
    assert step(4.0) == 1.0
    assert step(1.0, 0.8) == pytest.approx(2.0 / np.sqrt(1.8))
    assert step(0.0) == np.inf


def test_limits_in_words():
    assert as_text(limit(4.0, 0.0, None, "zone", (1.0, 2.0))) == "1.00 (set by zone at (1.00, 2.00) m)"
    assert as_text(limit(1.0, 0.0, 0.5, "node", (1.0, 2.0))) == "4.00 = 2 s (set by node at (1.00, 2.00) m)"
