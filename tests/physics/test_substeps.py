"""Sub-steps of the discs in a step of the grid: of order 2, and stable where the discs would bear the grid's step."""

import numpy as np
import pytest
from verification.coupling.bar import DENSITY, M, bar
from verification.coupling.block import block
from verification.coupling.restitution import rebound, restitution

DX = 0.25


@pytest.mark.parametrize("substeps", [2, 10])
def test_a_disc_bounces_off_a_bar_with_an_error_of_order_two(substeps):
    """No larger an error than without sub-steps; the step of the bar sets it."""
    error = np.array([abs(rebound(0.2, fine, substeps=substeps)[0] - restitution(0.2)) for fine in (10, 20, 40)])
    assert np.log2(error[:-1] / error[1:]) == pytest.approx([2.0, 2.0], abs=0.1)
    assert error[-1] < 1.2 * abs(rebound(0.2, 40)[0] - restitution(0.2))


def transfer(node, own, disc, contact, ground, substeps):
    """What a step of 1 makes of (u, v) of a node and (x, w) of a disc on it (4, 4).

    node, disc: masses; own, ground: springs of the node and of the disc to the ground; contact: the spring between them.
    """
    h = 1.0 / substeps
    u, v, x, w = np.eye(4)
    v = v + (contact * (x - u) - own * u) / node
    for _ in range(substeps):
        w = w + h * (contact * (u - x) - ground * x) / disc
        x, u = x + h * w, u + h * v
    return np.array([u, v, x, w])


def growth(substeps, omega, reserve, own, share):
    """Growth a step of a disc of frequency `omega` (`share` of its springs: the contact) on a node with springs `own` besides.

    reserve: M over the mass of the rule, m_I / 2 + S_I; own: in contacts' stiffnesses.
    """
    contact, ground = share * omega**2, (1.0 - share) * omega**2
    rule = 0.25 * own * contact + 0.5 * contact
    return np.abs(np.linalg.eigvals(transfer(reserve * rule, own * contact, 1.0, contact, ground, substeps))).max() - 1.0


def largest(omegas, reserve, seed=4, count=4000):
    """Largest growth of `count` random systems with frequencies between two `omegas` whose own steps are stable."""
    rng, found = np.random.default_rng(seed), 0.0
    for _ in range(count):
        omega = rng.uniform(*omegas)
        substeps = int(rng.integers(max(2, np.ceil(0.51 * omega)), 30))
        share = rng.choice([1.0, rng.uniform(0.02, 1.0)])
        found = max(found, growth(substeps, omega, reserve, rng.choice([0.0, 10.0 ** rng.uniform(-3.0, 3.0)]), share))
    return found


@pytest.mark.parametrize(("reserve", "limit"), [(1.0, 2.0), (2.0, 2.44)])
def test_a_disc_on_a_node_is_stable_up_to_the_limit_and_not_far_beyond(reserve, limit):
    """At the mass rule's edge, and with the factor 2 that agreed steps keep; round-off of double eigenvalues is 1e-8."""
    assert largest((0.1, limit), reserve) < 1e-6
    assert largest((1.05 * limit, 3.2), reserve) > 1e-2


@pytest.mark.parametrize("substeps", [2, 3, 10, 100])
def test_more_sub_steps_do_not_help_beyond_it(substeps):
    """Twice a period of the disc takes: the force at its ends feeds the node, however heavy that is."""
    omegas = np.linspace(2.4, 3.2, 801)
    assert max(growth(substeps, omega, 2.0, 0.0, 1.0) for omega in omegas) > 1e-2
    assert max(growth(substeps, omega, 200.0, 0.0, 1.0) for omega in omegas) > 1e-4


def shaken(joined, steps):
    """Energies of a chain that is shaken at random (steps,) over the first."""
    rng = np.random.default_rng(2)
    joined.grid.velocity[:, 0] = np.repeat(rng.normal(size=7), 2)[np.argsort(np.argsort(joined.grid_model.grid.xy[:, 0]))]
    joined.discs.v[1:, 0] = rng.normal(size=6)
    energy = np.array([joined.step_with_energy() for _ in range(steps)])
    return energy / energy[0]


def chain(light, substeps, share):
    """A bar with a chain of discs, `light` times as heavy as its columns, contacts 3 times as stiff."""
    joined, _ = bar(6, DX, 6, 3.0 * M, light * DENSITY * DX**2)
    joined.begin(share, from_rest=False, substeps=substeps)
    return joined


@pytest.mark.parametrize("substeps", [2, 3, 10])
def test_a_chain_of_both_codes_stays_bounded_at_the_longest_step(substeps):
    """Discs so light that they alone ask for a short step: the whole stable one of theirs."""
    joined = chain(0.05, substeps, 1.0)
    assert joined.grid.dt == pytest.approx(np.sqrt(0.05 * DENSITY * DX**2 / (2.0 * 3.0 * M)), rel=1e-9)
    assert joined.discs.next_dt == joined.grid.dt / substeps
    energy = shaken(joined, 4000)
    assert np.ptp(energy) < 0.01
    assert np.ptp(energy[2000:]) < 1.2 * np.ptp(energy[:2000])


def test_its_energy_stays_in_a_band_of_order_two_without_trend():
    """Without sub-steps it stays what it is, to round-off."""
    bands = []
    for share in (0.5, 0.25):
        energy = shaken(chain(1.0, 4, share), 4000)
        bands.append(np.ptp(energy))
        assert abs(energy[3000:].mean() - energy[:1000].mean()) < 0.05 * bands[-1]
    assert np.log2(bands[0] / bands[1]) == pytest.approx(2.0, abs=0.3)
    assert np.ptp(shaken(chain(1.0, 1, 0.5), 1000)) < 1e-10


def test_the_share_of_the_discs_grows_with_sub_steps_up_to_a_whole_stable_step():
    """Eq (1) of dem_server/step/clock.py."""
    steps = []
    for substeps in (1, 4, 10, 50):
        steps.append(chain(1e-4, substeps, 0.1).grid.dt)
    assert np.array(steps[1:]) / steps[0] == pytest.approx([4.0, 10.0, 10.0], rel=1e-9)


def test_a_block_in_the_plane_keeps_its_energy_within_such_a_band():
    """At 29 degrees, undamped, shaken on its gridpoints."""
    joined = block(around=1, across=2)
    joined.begin(0.25, from_rest=False, substeps=4)
    joined.grid.velocity[:] = 1e-7 * np.random.default_rng(5).normal(size=joined.grid.velocity.shape)
    energy = np.array([joined.step_with_energy() for _ in range(3000)])
    assert np.ptp(energy) < 2e-3 * energy.mean()
    assert np.ptp(energy[1500:]) < np.ptp(energy[:1500])
