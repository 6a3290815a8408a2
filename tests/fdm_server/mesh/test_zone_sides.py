"""Connected pieces of zones: against scipy's components of a graph, and where zones meet in single gridpoints."""

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from fdm_server.mesh.zone_sides import _components, pieces


@pytest.mark.parametrize("count", [1, 2, 7, 60, 4000])
@pytest.mark.parametrize("share", [0.0, 0.3, 0.5, 1.0])
def test_components_are_those_of_scipy(count, share):
    a, b = np.random.default_rng(count).integers(0, count, (2, int(share * count)))
    graph = coo_array((np.ones(len(a)), (a, b)), shape=(count, count))
    np.testing.assert_array_equal(_components(count, a, b), connected_components(graph, directed=False)[1])


def test_a_chain_in_any_order_is_one_component():
    way = np.random.default_rng(3).permutation(5000)
    assert not _components(5000, way[:-1], way[1:]).any()


def test_zones_that_meet_in_a_gridpoint_are_two_pieces_and_triangles_hold_together():
    square, right, corner, triangle = [0, 1, 4, 3], [1, 2, 5, 4], [4, 7, 8, 6], [6, 8, 9, 9]
    np.testing.assert_array_equal(pieces(np.array([square, corner, right, triangle])), [0, 1, 0, 1])
