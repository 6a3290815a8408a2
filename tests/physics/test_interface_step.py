"""The step agreed for real time is stable however stiff the contacts on the rim, and no longer than the rim's nodes allow."""

import numpy as np
import pytest
from verification.coupling.bar import DENSITY, M, bar
from verification.coupling.block import R
from verification.coupling.energy import shaken

DX = 0.25


def light_end(stiff, heavy):
    """A bar whose end carries no half disc, with a chain of contacts `stiff` times its columns, discs `heavy` times as heavy."""
    joined, _ = bar(6, DX, 6, stiff * M, heavy * DENSITY * DX**2, half_mass=False)
    return joined


def grown(joined, steps=2000):
    """Largest over first energy of a chain that is shaken."""
    rng = np.random.default_rng(2)
    joined.grid.velocity[:, 0] = np.repeat(rng.normal(size=7), 2)[np.argsort(np.argsort(joined.grid_model.grid.xy[:, 0]))]
    joined.discs.v[1:, 0] = rng.normal(size=6)
    energy = [joined.step_with_energy() for _ in range(steps)]
    return max(np.abs(energy)) / energy[0]


@pytest.mark.parametrize("stiff", [0.1, 1.0, 10.0, 1000.0])
def test_a_chain_stays_bounded_at_the_whole_agreed_step(stiff):
    """Heavy discs: nothing but the rim's nodes asks for a short step."""
    joined = light_end(stiff, 1e4)
    joined.begin(1.0, from_rest=False)
    assert grown(joined) < 1.0 + 1e-9


def test_without_the_rule_the_same_chain_blows_up():
    joined = light_end(100.0, 1e4)
    joined.begin(1.0, from_rest=False)
    agreed, free = joined.grid.dt, 0.25 / (1.5 * (M / DENSITY) ** 0.5)
    assert agreed < 0.2 * free
    joined.take(free, from_rest=False)
    with np.errstate(all="ignore"):
        assert not grown(joined, 100) < 1e3


def test_the_agreed_step_is_that_of_the_law():
    """End of the bar: M = rho dx^2 / 2, half at each of two gridpoints; static masses m of triangles. One contact with a share of
    1/2 of each, lever l/2. Normal: b = (1/2, 0), w = 1. Shear, ks = .4 k: b = (+-1/2, 1/2), w = sqrt 2, and with that
    k w b b^T / |b| = 2 ks b b^T.
    """
    k = 100.0 * M
    joined = light_end(100.0, 1e4)
    joined.begin(1.0, from_rest=False)
    ks = 0.4 * k
    rule = [[0.5 * k + 0.5 * ks, 0.5 * ks], [0.5 * ks, 0.5 * ks]]
    sums = np.linalg.eigvalsh(rule).max()
    static = joined.grid_model.mass[joined.nodes[0]]
    assert joined.grid.dt == pytest.approx(np.sqrt(0.25 * DENSITY * DX**2 / (static + 2.0 * sums)), rel=1e-12)


@pytest.mark.parametrize("shift", [0.0, 2.0 * R])
def test_a_block_in_the_plane_stays_bounded_at_the_whole_agreed_step(shift):
    energy, _ = shaken(1500, 1.0, shift=shift)
    assert np.ptp(energy) < 1e-6 * energy[0]
