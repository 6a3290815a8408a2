"""Tractions of a stress field on a rim, and whether it bears the weight inside."""

import numpy as np
import pytest
from window_case import ANGLE, OBLIQUE, rim

from coupler_protocol.geometry import polygon_area
from dem_server.insitu.zone_stress import imbalance, stress_field, tractions

UNIT = 26.5e3  # weight of the ground [N/m3]


def sloping(points):
    """A stress in equilibrium with UNIT: principal axes at 30 degrees, growing along -x and -y."""
    xx, yy, xy = -0.68, -0.89, -0.19
    m = np.linalg.solve([[xx, xy], [xy, yy]], [0.0, -UNIT])
    depth = 1e5 - points @ m
    return np.outer(depth, [xx, yy, xy])


@pytest.mark.parametrize("corners", [OBLIQUE, ANGLE], ids=["oblique", "angle"])
@pytest.mark.parametrize(("weight", "expected"), [(1.0, 0.0), (0.8, 0.25), (1.25, -0.2)])
def test_weight_that_the_stress_does_not_bear(corners, weight, expected):
    """With a share w of the weight that the stress bears, 1/w - 1 of it is left over."""
    found = imbalance(rim(corners), sloping, weight * UNIT * polygon_area(corners))
    np.testing.assert_allclose(found, [0.0, expected], atol=1e-9)


def test_a_uniform_stress_pulls_along_its_normals():
    square = rim(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]))
    force = tractions(square, lambda points: np.tile([2.0, -3.0, 0.5], (len(points), 1)))
    np.testing.assert_allclose(force[:4].sum(axis=0), [-0.5, 3.0])  # on the base, from outside
    np.testing.assert_allclose(force[4:8].sum(axis=0), [2.0, 0.5])
    assert imbalance(square, lambda points: np.zeros((len(points), 3)), 0.0).tolist() == [0.0, 0.0]


def test_linear_fields_are_met_exactly():
    xy = np.random.default_rng(0).random((60, 2))
    stress = np.column_stack([xy[:, 0], 3.0 - xy[:, 1], xy.sum(axis=1)])
    field = stress_field(np.column_stack([xy, np.ones(60), stress, np.ones(60)]))
    np.testing.assert_allclose(field(np.array([[0.3, 1.4]])), [[0.3, 1.6, 1.7]], atol=1e-9)
