"""Separation from held discs and renewed contact.

*Bond*: a disc bonded to a held one, at an angle, is pulled off and returned after a rotation of 0.7 rad about it: the bond
stays broken, nothing pulls, and in the new contact the normal force is kn times the overlap and the shear force starts at 0.
*Bounces*: a disc flies between two held discs, without damping, in steps of 0.05 of the stable one, and keeps its speed over
thousands of contacts."""

from itertools import pairwise

import numpy as np

from dem_server.effects.bond import BONDED, Bond
from dem_server.observe import energy
from dem_server.pairs import contacts
from dem_server.step.cycle import advance, in_real_time
from verification.discrete.discs import KN, displace, with_held
from verification.verdict_rows import row

NAME = "recontact"
R = 0.03


def pulled_off_and_back():
    """State after the return, overlap [m], largest tension after the break [N], number of broken bonds."""
    start, back = (np.array([np.cos(a), np.sin(a)]) for a in (0.4, 1.1))
    glue = Bond(tension=1500.0, shear=3500.0)
    model, state = with_held([[0.0, 0.0]], [R], [2.0 * R * start], [R], bond=glue)
    state.bond_state[:] = BONDED
    overlap, tension = 1e-5, 0.0
    places = [2.0 * R * start, 3.0 * R * start, 3.0 * R * back, (2.0 * R + 2e-7) * back, (2.0 * R - overlap) * back]
    for a, b in pairwise(places):
        steps = max(1, round(np.hypot(*(b - a)) / 5e-6))
        for _ in range(steps):
            displace(model, state, np.array([[0.0, 0.0], (b - a) / steps]))
            if state.broken_tension:
                tension = max(tension, float(-state.normal.min(initial=0.0)))
    return state, overlap, tension


def bounces(steps):
    """Energy at the end over that at the start, contacts made."""
    held = [[0.0, 0.0], [6.0 * R, 0.0]]
    model, state = with_held(held, [R, R], [[3.0 * R, 0.0]], [R], bond=None, damping=None, friction=None)
    model = in_real_time(model, state, 0.05)
    state.v[2] = 1.0, 0.0
    start, made, before = energy.kinetic(model, state), 0, False
    for _ in range(steps // 20):
        advance(model, state, 0.0, 20)
        now = len(contacts(state).slot) > 0
        made += now and not before
        before = now
    while len(contacts(state).slot):
        advance(model, state, 0.0, 1)
    return energy.kinetic(model, state) / start, made


def rows(fast):
    """The bond, and a million steps of bounces (fast: 60,000)."""
    state, overlap, tension = pulled_off_and_back()
    pair = contacts(state)
    yield row("bonds broken", state.broken_tension + state.broken_shear, 1.0, 0.0, "it does not heal")
    yield row("largest tension after the break [N]", tension, 0.0, 0.0, "closed form")
    yield row("normal force in contact again [N]", pair.normal_force[0], KN * overlap, 1e-6, "closed form")
    share = abs(pair.shear_force[0] / pair.normal_force[0])
    yield row("shear over normal force in contact again", share, 0.0, 1e-3, "closed form")
    left, made = bounces(60_000 if fast else 1_000_000)
    yield row(f"energy after {made} contacts over that at the start", left, 1.0, 1e-2, "conservation")
