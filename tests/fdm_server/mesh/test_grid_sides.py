"""Sides of the grid and the components of velocity held on them."""

import numpy as np
import pytest
from grid_cases import slope

from coupler_protocol.scene.tables.boundary import Boundary
from fdm_server.mesh.grid import build_grid
from fdm_server.mesh.grid_sides import fixed_components, side_of


@pytest.fixture(scope="module")
def paper():
    return build_grid(slope())


@pytest.mark.parametrize(("side", "points"), [("left", 13), ("right", 37), ("bottom", 61), ("face", 25), ("top", 12 + 26)])
def test_sides_of_the_paper_slope(paper, side, points):
    assert len(side_of(paper, side)) == points


def test_an_unknown_side_is_refused(paper):
    with pytest.raises(ValueError, match="left, right, bottom, top, face"):
        side_of(paper, "crest")


def test_fixed_components_add_up(paper):
    fixed = fixed_components(paper, slope().boundary)
    x, y = paper.xy.T
    assert np.array_equal(fixed[:, 0], (x < 1e-9) | (x > 20 - 1e-9) | (y < 1e-9))
    assert np.array_equal(fixed[:, 1], y < 1e-9)
    again = fixed_components(paper, [Boundary(on="bottom", fix="y"), Boundary(on="bottom", fix="x")])
    assert fixed_components(paper, []).sum() == 0
    assert np.array_equal(again[:, 0], again[:, 1])
