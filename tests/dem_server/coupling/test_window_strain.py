"""Bins that a continuum asks for are counted before any are made."""

from types import SimpleNamespace

import numpy as np
import pytest

from coupler_protocol.exits import PeerLost
from dem_server.coupling.window_strain import bins_over_box
from dem_server.procedure.window_side import DiscreteSide

NODES = np.array([[1.0, 2.0], [5.0, 2.0], [5.0, 4.0], [1.0, 4.0]])


def test_the_number_of_bins_over_the_box_of_a_rim():
    assert bins_over_box(NODES, 0.5) == 32.0
    assert bins_over_box(NODES, 100.0) == 1.0


@pytest.mark.parametrize("length", [1e-9, 1e-320, 0.0, -1.0])
def test_a_continuum_that_asks_for_too_many_bins_is_refused(length):
    side = SimpleNamespace(rim=SimpleNamespace(nodes=NODES))
    with pytest.raises(PeerLost, match="the continuum wants the strain in bins of"):
        DiscreteSide._prepare_talk(side, length)
