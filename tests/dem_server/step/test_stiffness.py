"""The stiffness of a pair that masses, limits and the interface count is the one that its forces and energy have."""

import numpy as np
import pytest
from verification.discrete.discs import loose_discs

from coupler_protocol.criteria.stable_step import spring_sums
from dem_server.effects.friction import Friction
from dem_server.effects.rolling import Rolling
from dem_server.model import MOMENT
from dem_server.observe import energy
from dem_server.observe.stable_limit import springs_of
from dem_server.pairs import contacts
from dem_server.step.contact_pass import contact_forces
from dem_server.step.cycle import in_real_time
from dem_server.step.motion import move_free
from dem_server.step.stiffness import pair_stiffnesses, sums

R = 0.03
SMALL = np.array([R, 0.7 * R])  # two radii
REDUCED = SMALL.prod() / SMALL.sum()
TURN = 1e-6  # [rad]


def two_rolling(friction):
    """Two discs, pressed together obliquely, with rolling resistance that does not slip; their contact is known."""
    along = np.array([np.cos(0.4), np.sin(0.4)])
    more = {"rolling": Rolling(coefficient=1e6), "friction": friction, "bond": None, "damping": None}
    model, state = loose_discs(np.array([0.0 * along, 0.99 * SMALL.sum() * along]), SMALL, False, **more)
    model = in_real_time(model, state, 1e-3)
    contact_forces(model, state)
    return model, state


def at_rest(model, state):
    """Contact forces of the present places, without motion."""
    state.v[:], state.spin[:] = 0.0, 0.0
    contact_forces(model, state)


@pytest.mark.parametrize("friction", [None, Friction(coefficient=1e6)], ids=["rolling alone", "with friction"])
def test_the_rolling_spring_is_the_same_everywhere(friction):
    """kr = ks Rb^2 whether or not shear forces act: moment, energy, masses, limit of the step and mass rule of the interface.

    The two discs turn against each other such that the contact does not slide: r1 w1 + r2 w2 = 0.
    """
    model, state = two_rolling(friction)
    shear = model.law.spring.shear[contacts(state).kind[0]]
    expected = shear * REDUCED**2
    kn, ks, kr = pair_stiffnesses(model, state, contacts(state))
    assert kr == pytest.approx([expected], rel=1e-12)
    assert (kn[0], ks[0]) == (model.law.spring.normal[contacts(state).kind[0]], shear if friction else 0.0)
    assert sums(model, state).discs[:, 2] == pytest.approx(shear * SMALL**2 + expected, rel=1e-12)
    lever = SMALL - 0.5 * (SMALL.sum() * 0.01)
    shares = 4.0 * lever**2 * shear if friction else 0.0  # the shear spring moves a disc in two blocks
    assert spring_sums(springs_of(model, state)).rotations == pytest.approx(shares + 2.0 * expected, rel=1e-9)

    move_free(model, state, 0.0)  # sets the time of the step
    at_rest(model, state)
    before = energy.stored(model, state)
    turn = TURN * np.array([-lever[1], lever[0]]) / lever.sum()
    state.spin[:] = turn / state.dt
    contact_forces(model, state)
    relative = turn[1] - turn[0]
    assert state.load[:, MOMENT] == pytest.approx(expected * relative * np.array([1.0, -1.0]), rel=1e-6)
    assert energy.stored(model, state) - before == pytest.approx(0.5 * expected * relative**2, rel=1e-6)


def test_without_a_shear_effect_nothing_resists_sliding():
    """ks = 0 is what the force does: a contact that slides has no force along it, with rolling resistance or not."""
    model, state = two_rolling(None)
    normal, pressed = contacts(state).normal[0], state.force.copy()
    move_free(model, state, 0.0)
    at_rest(model, state)
    state.v[1] = 1e-6 / state.dt * np.array([-normal[1], normal[0]])
    contact_forces(model, state)
    assert abs(state.force[1] @ [-normal[1], normal[0]]) < 1e-12 * np.abs(pressed).max()
