"""Two discs collide: dashpots give the coefficient of restitution (scripts/verification/discrete/collision.py)."""

import numpy as np
import pytest
from disc_cases import KN, KS, loose_discs
from verification.discrete.collision import R, collided, restitution

from dem_server.effects.bond import Bond
from dem_server.effects.dashpot import Dashpot
from dem_server.pairs import contacts
from dem_server.step.cycle import advance, in_real_time


@pytest.mark.parametrize(
    ("beta", "tension", "expected"), [(0.1, True, 0.7292), (0.5, True, 0.1630), (0.1, False, 0.7441), (0.5, False, 0.2984)]
)
def test_published_restitutions(beta, tension, expected):
    _, state, along = collided(beta, tension)
    assert (state.v[1] - state.v[0]) @ along == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize("turned", [0.0, 0.7, 2.4])
@pytest.mark.parametrize("tension", [True, False])
@pytest.mark.parametrize("beta", [0.0, 0.03, 0.3, 0.7, 0.9])
def test_restitution_of_unequal_discs(beta, tension, turned):
    _, state, along = collided(beta, tension, (R, 0.6 * R), turned)
    assert (state.v[1] - state.v[0]) @ along == pytest.approx(restitution(beta, tension), abs=1e-4)
    np.testing.assert_allclose(state.mass @ state.v, 0.5 * (state.mass[0] - state.mass[1]) * along, rtol=1e-9, atol=1e-12)
    assert len(contacts(state).disc_a) == 0


@pytest.mark.parametrize("fraction", [1e-1, 1e-2, 1e-3])
def test_error_goes_with_the_step(fraction):
    for beta in (0.1, 0.3, 0.5):
        _, state, along = collided(beta, False, fraction=fraction)
        assert abs((state.v[1] - state.v[0]) @ along - restitution(beta, False)) < 0.25 * fraction


@pytest.mark.parametrize("turned", [0.0, 1.1])
def test_a_bonded_pair_rings_down_in_the_gap_and_in_slip(turned):
    """Damped oscillators: in the gap omega^2 = 2 kn / m with beta, in slip (turns included) 6 ks / m with sqrt(3) beta."""
    beta, along = 0.05, np.array([np.cos(turned), np.sin(turned)])
    across = np.array([-along[1], along[0]])
    for direction, stiffness, factor in ((along, KN, 2.0), (across, KS, 6.0)):
        glue, dashpot = Bond(tension=1e9, shear=1e9), Dashpot(normal=beta, shear=beta)
        model, state = loose_discs([[0.0, 0.0], 2.0 * R * along], [R, R], bonded=True, bond=glue, dashpot=dashpot, damping=None)
        model = in_real_time(model, state, 1e-3)
        state.v[:] = -1e-6 * direction, 1e-6 * direction
        if factor == 6.0:
            state.spin[:] = -2e-6 / R
        effective = beta * np.sqrt(factor / 2.0)
        period = 2.0 * np.pi / np.sqrt(factor * stiffness / state.mass[0] * (1.0 - effective**2))
        advance(model, state, 0.0, round(period / state.next_dt))
        left = (state.v[1] - state.v[0]) @ direction / 2e-6
        assert left == pytest.approx(np.exp(-2.0 * np.pi * effective / np.sqrt(1.0 - effective**2)), rel=2e-3)
