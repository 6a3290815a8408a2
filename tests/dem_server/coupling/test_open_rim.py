"""The mass rule of an open rim uses the motion that its discs have: shares and spins are those of the mapping."""

import numpy as np
import pytest

from coupler_protocol.interface.mapping import velocities_to_discs
from coupler_protocol.interface.ring import build_ring
from dem_server.coupling.rim import Rim, spins

CHAIN = np.array([[0.0, 2.0], [0.0, 1.4], [0.1, 0.0], [1.0, 0.0], [2.0, 0.1], [2.0, 1.0], [2.1, 2.0]])


@pytest.mark.parametrize("surface", [None, np.array([[1.0, 2.3]]), np.empty((0, 2))], ids=["closed", "ridge", "level"])
def test_shares_and_spins_of_all_discs_are_those_of_the_mapping(surface):
    ring = build_ring(CHAIN, 0.1, surface)
    rim, rng = Rim(ring, "work-consistent"), np.random.default_rng(3)
    v, vd, spin = rng.standard_normal(CHAIN.shape), np.empty_like(ring.xy), np.empty(len(ring.xy))
    velocities_to_discs(ring.nodes, v, *rim.where, ring.xy, vd, spin, False)
    L = np.empty((3, 2))
    for p, (three, share) in enumerate(zip(rim._three, rim._translation, strict=True)):
        spins(ring.nodes, ring.seg0[p], ring.seg1[p], ring.w0[p], L)
        assert np.sum(L * v[three]) == pytest.approx(spin[p], abs=1e-12)
        np.testing.assert_allclose(share @ v[three], vd[p], atol=1e-12)
        np.testing.assert_allclose(share @ ring.nodes[three], ring.xy[p], atol=1e-12)


def test_the_weight_of_the_discs_of_an_open_rim_is_on_its_nodes():
    ring = build_ring(CHAIN, 0.1, np.empty((0, 2)))

    class State:
        weight = np.arange(1.0, len(ring.xy) + 1.0)

    assert Rim(ring, "work-consistent").inner_mass(State).sum() == pytest.approx(State.weight.sum(), rel=1e-14)
