"""The mean strain of discs is that of the motion that moves them."""

import numpy as np
import pytest
from disc_cases import loose_discs

from dem_server.observe.sample_strain import mean_strain


def test_affine_motion_with_a_turn_and_noise():
    """Stretch, shear and a turn of any origin are found exactly; what cancels out over the discs changes nothing."""
    rng = np.random.default_rng(5)
    xy = rng.uniform([100.0, -7.0], [102.0, -4.0], (60, 2))
    model, state = loose_discs(xy, rng.uniform(0.01, 0.05, 60))
    gradient = np.array([[-2e-3, 5e-4], [-1e-4, 1e-3]])
    state.x[:] = xy + [0.3, -0.2] + xy @ gradient.T
    assert mean_strain(model, state) == pytest.approx([-2e-3, 1e-3, 2e-4], rel=1e-9)


def test_discs_on_a_line_have_no_strain():
    model, state = loose_discs(np.column_stack([np.arange(5.0), np.zeros(5)]), np.full(5, 0.1))
    assert np.isnan(mean_strain(model, state)).all()
