"""Neighbouring discs with a stiffness ratio of ten thousand.

64 discs, about half of them with springs 1e4 times as stiff, mixed at random. *Gas*: they fly and collide between walls at 1
m/s in real time, without damping and friction, in default steps; energy is the mean over 400 steps. *Static*: the same discs,
overlapping at random at first, come to rest in a box of walls with friction.
"""

from types import SimpleNamespace

import numpy as np

from dem_server.effects import STONE
from dem_server.effects.damping import Damping
from dem_server.effects.friction import Friction
from dem_server.effects.spring import Spring
from dem_server.observe import energy
from dem_server.observe.unbalanced_ratio import unbalanced_ratio
from dem_server.step.cycle import advance, in_real_time, in_static_mode
from dem_server.step.neighbours import rebuild
from dem_server.step.walls import make_walls
from verification.discrete.discs import loose_discs
from verification.discrete.gas import mean_energy
from verification.verdict_rows import row

NAME = "stiffness jump"
R, RATIO = 0.03, 1e4


def mixed(spacing, **laws):
    """Model and State of 8 x 8 discs at `spacing` (in R), soft and stiff ones at random, in a box of walls."""
    rng = np.random.default_rng(3)
    side = (np.arange(8) + 0.5) * spacing * R
    xy = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2) + rng.uniform(-0.05, 0.05, (64, 2)) * R
    stiff = SimpleNamespace(density=2000.0, spring=Spring(normal=RATIO * 5e7, shear=RATIO * 2e7), bond=None, **laws)
    radius = R * rng.choice([0.8, 0.9, 1.0], 64)
    model, state = loose_discs(xy, radius, bond=None, stone=stiff, friction=laws.get("friction"), damping=laws.get("damping"))
    model.material[rng.random(64) < 0.5] = STONE
    end = 8.0 * spacing * R
    corners = np.array([[0.0, 0.0], [end, 0.0], [end, end], [0.0, end]])
    state.walls = make_walls(np.hstack([corners, np.roll(corners, -1, axis=0)]), np.zeros((4, 2)), model)
    rebuild(model, state)
    return model, state, end


def rows(fast):
    """Gas, then rest."""
    model, state, end = mixed(2.2)
    model = in_real_time(model, state, 0.1)
    state.v[:] = np.random.default_rng(9).normal(0.0, 1.0, state.v.shape)
    start = mean_energy(model, state)
    steps = 20_000 if fast else 1_000_000
    advance(model, state, 0.0, steps)
    yield row(f"gas: energy after {steps:,} steps [J]", mean_energy(model, state), start, 1e-2, "conservation")
    inside = ((state.x > 0.0) & (state.x < end)).all(axis=1).sum()
    yield row("gas: discs between the walls", inside, 64.0, 0.0, "none passes")
    model, state, end = mixed(1.75, friction=Friction(coefficient=0.55), damping=Damping(local=0.7))
    model = in_static_mode(model, state)
    for _ in range(200):
        advance(model, state, 0.0, 1000)
        share = energy.kinetic(model, state) / energy.stored(model, state)  # also of discs that fly between others
        if max(unbalanced_ratio(model, state, 0.0), share) < 1e-6:
            break
    yield row("static: unbalanced ratio", unbalanced_ratio(model, state, 0.0), 0.0, 1e-6, "as asked for")
    yield row("static: kinetic over stored energy", share, 0.0, 1e-6, "it rests")
