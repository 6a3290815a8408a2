"""Discs that fly and collide without damping and friction keep their energy at the default step of real time.

36 discs of three sizes in a box of walls, velocities at random of .3 or 3 m/s. The energy is kinetic and stored, the mean over
400 steps at the beginning and at the end.
"""

import numpy as np

from coupler_protocol.scene import scene_class
from dem_server import energy
from dem_server.cycle import advance, in_real_time
from dem_server.neighbours import rebuild
from dem_server.walls import make_walls
from verification.discrete.discs import loose_discs
from verification.rows import row

NAME = "gas"
R, SIDE = 0.03, 6
BOX = SIDE * 2.2 * R


def default_fraction():
    """Share of the stable step that scenes take where they say nothing."""
    discs = scene_class().model_fields["discs"].annotation.__args__[0]
    return discs.model_fields["time_step"].default


def gas(speed, fraction):
    """Discs of three sizes in a box, moving at random."""
    rng = np.random.default_rng(4)
    side = (np.arange(SIDE) + 0.5) * 2.2 * R
    xy = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    model, state = loose_discs(xy, R * rng.choice([0.8, 0.9, 1.0], len(xy)), bond=None, friction=None, damping=None)
    corners = np.array([[0.0, 0.0], [BOX, 0.0], [BOX, BOX], [0.0, BOX]])
    state.walls = make_walls(np.hstack([corners, np.roll(corners, -1, axis=0)]), np.zeros((4, 2)), model)
    rebuild(model, state)
    model = in_real_time(model, state, fraction)
    state.v[:] = rng.normal(0.0, speed, xy.shape)
    return model, state


def mean_energy(model, state, steps=400):
    """Mean over steps of kinetic (of both half steps) and elastic energy."""
    total = 0.0
    for _ in range(steps):
        before, stored = energy.kinetic(model, state), energy.stored(model, state)
        advance(model, state, 0.0, 1)
        total += 0.5 * (before + energy.kinetic(model, state)) + stored
    return total / steps


def rows(fast):
    """A million steps (fast: 20,000)."""
    steps = 20_000 if fast else 1_000_000
    for speed in (0.3, 3.0):
        model, state = gas(speed, default_fraction())
        start = mean_energy(model, state)
        advance(model, state, 0.0, steps)
        yield row(f"energy after {steps:,} steps, {speed:g} m/s [J]", mean_energy(model, state), start, 1e-2, "conservation")
