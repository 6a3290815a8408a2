"""Collisions of discs and stones conserve momentum and angular momentum.

25 discs of three sizes and five rigid stones of two to four discs, with friction, rolling resistance and dashpots, fly at each
other with random velocities and spins, collide and separate; no walls, no gravity, no damping. Contact forces are
opposite, and the levers li, lj of both discs add up to the distance of their centres, so nothing is lost:

    sum m v = const,     sum m x (x) v + I w = const

Leap-frog conserves both exactly, because positions move along the velocities in these products. Relative to sum m |v| and sum m
|x| |v| + I |w|.
"""

from types import SimpleNamespace

import numpy as np

from dem_server.effects.dashpot import Dashpot
from dem_server.effects.friction import Friction
from dem_server.effects.rolling import Rolling
from dem_server.effects.spring import Spring
from dem_server.observe import energy
from dem_server.step.cycle import advance, in_real_time
from dem_server.stones import bodies as stones
from verification.discrete.discs import loose_discs
from verification.verdict_rows import row

NAME = "conservation"
R = 0.03
LAWS = {"friction": Friction(coefficient=0.5), "rolling": Rolling(coefficient=0.1), "dashpot": Dashpot(normal=0.1, shear=0.1)}


def crowd(fraction=0.1, **laws):
    """Model and State of discs and stones that fly at each other, in real time with steps of `fraction` of the stable one."""
    laws = {"friction": None} | laws
    rng = np.random.default_rng(7)
    side = 4.4 * R * (np.arange(6) - 2.5)
    places = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    xy, radius, outlines = [], [], []
    for k, place in enumerate(places[:30]):
        if k % 6:
            xy.append(place[None])
            radius.append([R * rng.choice([0.7, 0.85, 1.0])])
            continue
        turn, count = rng.uniform(0.0, np.pi), 2 + k // 12
        along = np.array([np.cos(turn), np.sin(turn)])
        across = np.array([-along[1], along[0]])
        at = np.linspace(-1.0, 1.0, count)
        xy.append(place + R * np.outer(at, along))
        radius.append(np.full(count, 0.6 * R))
        outlines.append(place + R * np.array([-1.6 * along - 0.6 * across, 1.6 * along - 0.6 * across,
                                              1.6 * along + 0.6 * across, -1.6 * along + 0.6 * across]))  # fmt: skip
    grain = SimpleNamespace(density=2700.0, spring=Spring(normal=5e8, shear=2e8), bond=None, **laws)
    model, state = loose_discs(np.vstack(xy), np.concatenate(radius), bond=None, damping=None, stone=grain, **laws)
    stones.assign_discs(model, state, outlines, 2700.0)
    model = in_real_time(stones.form_stones(model, state, outlines, "clump"), state, fraction)
    for body in (state.disc, state.clumps.motion):
        body[:, 2:4] = -3.0 * body[:, :2] / R * 0.1 + rng.normal(0.2, 0.5, (len(body), 2))
        body[:, 4] = rng.normal(0.0, 10.0, len(body))
    return model, state


def momenta(state):
    """Momentum (2,), angular momentum, and what they are measured by."""
    own = state.clumps.body < 0
    bodies = np.vstack([state.disc[own][:, [0, 1, 2, 3, 4, 6, 7]], state.clumps.motion[:, [0, 1, 2, 3, 4, 6, 7]]])
    x, y, u, v, w, mass, inertia = bodies.T
    speed, place = np.hypot(u, v), np.hypot(x, y)
    momentum = np.array([mass @ u, mass @ v])
    return momentum, mass @ (x * v - y * u) + inertia @ w, mass @ speed, mass @ (place * speed) + inertia @ np.abs(w)


def rows(fast):
    """With all laws; and how much energy that took, so that it is seen that they met."""
    model, state = crowd(**LAWS)
    before, kinetic = momenta(state), energy.kinetic(model, state)
    advance(model, state, 0.0, 20_000)
    after = momenta(state)
    yield row("change of momentum", np.hypot(*(after[0] - before[0])) / before[2], 0.0, 1e-13, "conservation")
    yield row("change of angular momentum", (after[1] - before[1]) / before[3], 0.0, 1e-13, "conservation")
    yield row("kinetic energy left", energy.kinetic(model, state) / kinetic, 0.5, [-1.0, 0.9], "they have met")
