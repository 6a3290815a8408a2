"""How long a coupled step may be: closed form, dense eigenvalues, and the code's own steps on both sides of the limit."""

from dataclasses import replace

import numpy as np
import pytest
from verification.hard.coupled_system import BULK, MODULUS, SHEAR, at_share, excite, growth, system, with_few_discs

from colluvium.forecast import linearised_step
from coupler_protocol.criteria.stable_step import highest, spring_sums
from dem_server.observe.stable_limit import safe_limit, springs_of
from dem_server.step.contact_pass import contact_forces
from dem_server.step.neighbours import rebuild
from fdm_server.observe.stable_limit import safe_limits


def with_one_disc(node, direction, stiffness, shear, damping):
    """One disc on the control disc of a rim node, `direction` [rad] from it; also the gridpoint of the node.

    stiffness: kn over K + 4G/3 of the zones; shear: ks over kn.
    """

    def place(ring):
        at = int(np.flatnonzero(ring.node == node)[0])
        away = 2.0 * ring.radius[at] * 0.999 * np.array([np.cos(direction), np.sin(direction)])
        return (ring.xy[at] + away)[None], ring.radius[at : at + 1]

    found = with_few_discs(place, stiffness, 0.125, damping, shear)
    return found, int(found.windows[0].nodes[node])


def fastest_of_two(k_zones, M, k, mu):
    """Largest omega^2 of a mass M on the spring k_zones to the ground, with a mass mu behind a spring k."""
    a, b = (k_zones + k) / M, k / mu
    return 0.5 * (a + b) + np.sqrt(0.25 * (a - b) ** 2 + k * k / (M * mu))


@pytest.mark.parametrize("ratio", [0.1, 1.0, 1000.0])
@pytest.mark.parametrize("shear", [0.4, 1.0])
def test_one_node_and_one_disc(ratio, shear):
    """A rim node between two square zones, all others held: its zones are a spring (K + 13 G/3)/2 in any direction."""
    k_zones, kn = 0.5 * (BULK + 13.0 / 3.0 * SHEAR), ratio * MODULUS
    (model, state, windows), point = with_one_disc(2, 0.5 * np.pi, ratio, shear, 0.0)
    fixed = np.ones_like(model.fixed)
    fixed[point] = False
    model = replace(model, fixed=fixed)
    disc, lever = windows[0].state, 0.999 * windows[0].state.radius[-1]
    M = model.mass[point] + state.added_mass[point]
    # The mass rule: half of either spring, and twice that to spare; along the rim the lever moves both neighbours as well.
    assert state.added_mass[point] == pytest.approx(kn * max(1.0, shear * (1.0 + lever)), rel=1e-9)
    along = fastest_of_two(k_zones, M, kn, disc.mass[-1])
    across = fastest_of_two(k_zones, M, shear * kn, 1.0 / (1.0 / disc.mass[-1] + lever**2 / disc.inertia[-1]))
    omega2, _ = highest(*linearised_step.operator(model, state, windows))
    assert omega2 == pytest.approx(max(along, across), rel=1e-9)


@pytest.mark.parametrize("oblique", [False, True])
@pytest.mark.parametrize("damping", [0.0, 0.8])
def test_lanczos_finds_the_dense_eigenvalue_and_no_safe_limit_is_beyond_it(oblique, damping):
    found = system(10.0, 0.08 if oblique else 0.25, damping, oblique=oblique)
    K, mass = linearised_step.operator(*found)
    scale = mass**-0.5
    dense = np.linalg.eigvalsh(K.toarray() * scale * scale[:, None])[-1]
    exact = linearised_step.exact_limit(*found)
    assert exact["share"] == pytest.approx(2.0 / np.sqrt(dense), rel=1e-8)
    nodes = found.windows[0].nodes
    safe = [*safe_limits(found.model, found.state, nodes, found.state.added_mass[nodes]).values()]
    safe.append(safe_limit(*found.windows[0][1:]))
    assert 1.0 < exact["share"] / min(limit["share"] for limit in safe) < 2.0
    assert min(limit["share"] for limit in safe) > 1.0  # a step of 1 is safe, and known to be


@pytest.mark.parametrize("damping", [0.0, 0.8])
@pytest.mark.parametrize("stiffness", [0.1, 1.0, 1000.0])
@pytest.mark.parametrize(("size", "oblique", "steps"), [(0.25, False, 20_000), (1 / 16, False, 2_000), (0.08, True, 2_000)])
def test_steps_stay_bounded_below_the_limit_and_grow_beyond_it(damping, stiffness, size, oblique, steps):
    """The mode at the limit, and noise: at .99 of it the largest speed stays within its beat, at 1.01 it grows 1e5 fold."""
    found = {}
    for share in (0.99, 1.01):
        case, mode = at_share(system(stiffness, size, damping, oblique=oblique), share)
        excite(case, mode, 1e-9 * size, np.random.default_rng(0))
        found[share] = growth(case, steps if share < 1.0 else 500)
    assert found[0.99] < 5.0
    assert found[1.01] == np.inf


@pytest.mark.parametrize("damping", [0.0, 0.8])
@pytest.mark.parametrize("shear", [0.4, 1.0])
def test_the_mass_rule_holds_a_single_disc_at_any_place(shear, damping):
    """One disc far stiffer than the zones, at nodes along a side and in a corner: omega^2 (1 + alpha) < 4, and so it moves."""
    worst = 0.0
    for node in (0, 1, 2):
        for direction in np.linspace(0.05, 0.5, 10) * np.pi:
            found, _ = with_one_disc(node, direction, 1e4, shear, damping)
            omega2, mode = highest(*linearised_step.operator(*found))
            if omega2 > worst:
                worst, case, shape = omega2, found, mode
    assert worst < 3.9
    excite(case, shape, 1e-9, np.random.default_rng(0))
    assert growth(case, 2000) < 5.0


def test_the_mass_rule_follows_a_rim_that_is_turned_and_stretched():
    """Nodes carried along by a large motion: the rule still is half the bound of the springs of all near pairs."""
    found = system(1.0, 0.08, 0.0, oblique=True)
    _, model, state, rim = found.windows[0]
    before = rim.stiffness_sums(model, state).copy()
    for _ in range(20):
        rim.move(state, 0.02 * rim.nodes @ np.array([[2.0, -0.5], [1.0, -0.3]]))
    rebuild(model, state)
    sums = rim.stiffness_sums(model, state)
    assert np.abs(sums / before - 1.0).max() > 0.05
    np.testing.assert_allclose(spring_sums(springs_of(model, state, rim, listed=True)).nodes, 2.0 * sums, rtol=1e-9)


def test_broken_bonds_only_take_springs_away():
    found = system(1.0, 0.25, 0.0)
    window = found.windows[0]
    whole = highest(*linearised_step.operator(*found))[0]
    sums = window.rim.stiffness_sums(window.model, window.state).copy()
    window.state.bond_state[::2] = 0
    contact_forces(window.model, window.state)
    np.testing.assert_array_equal(window.rim.stiffness_sums(window.model, window.state), sums)
    assert highest(*linearised_step.operator(*found))[0] < whole
