"""Contact forces are internal: together they have no resultant and no moment, whatever the discs do."""

import numpy as np
from disc_cases import KN, displace, loose_discs

R = 0.03


def test_no_resultant_force_or_moment():
    rng = np.random.default_rng(3)
    side = np.arange(12) * 1.97 * R
    xy = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2) + rng.normal(0.0, 0.02 * R, (144, 2))
    model, state = loose_discs(xy, R * rng.uniform(0.95, 1.05, 144), bonded=True)
    for _ in range(50):
        displace(model, state, rng.normal(0.0, 1e-3 * R, (144, 2)), rng.normal(0.0, 1e-3, 144))
    scale = KN * R
    assert state.broken_tension > 0
    assert np.abs(state.force).max() > 1e-4 * scale
    np.testing.assert_allclose(state.force.sum(axis=0), 0.0, atol=1e-13 * scale)
    turning = state.x[:, 0] * state.force[:, 1] - state.x[:, 1] * state.force[:, 0]
    np.testing.assert_allclose((turning + state.moment).sum(), 0.0, atol=1e-13 * scale)
