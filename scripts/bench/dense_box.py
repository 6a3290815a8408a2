"""Dense packings of any size, made in seconds and always the same: one tile, packed periodically, side by side.

The tile holds 625 discs of radii uniform in 0.03 (1 ± 0.25) m at a porosity of 0.145, which is about 150 kPa for the paper's
soil. They start from a low-discrepancy sequence and relax without friction over the tile's periodic edges. Copies of the tile
fill the box, free discs sorted in space; copies of the discs next to the box, about two layers, are held."""

from types import SimpleNamespace

import numpy as np
from scipy.spatial import cKDTree

from dem_server.effects.bond import Bond
from dem_server.effects.damping import Damping
from dem_server.effects.friction import Friction
from dem_server.effects.spring import Spring
from dem_server.model import build_model
from dem_server.packing.packing import PLASTIC, Packing, in_strips

IN_TILE = 625
RADIUS, SPREAD, POROSITY = 0.03, 0.25, 0.145
ROUNDS, STEPS = 80, 25  # of relaxation; near pairs are found anew every round
FRICTION, BOND = Friction(coefficient=0.55), Bond(tension=1e6, shear=1e6)  # bonds so strong that none breaks


def tile():
    """Centres (625, 2), radii (625,) and side [m] of the periodic tile."""
    radius = RADIUS * np.random.default_rng(1).uniform(1.0 - SPREAD, 1.0 + SPREAD, IN_TILE)
    side = float(np.sqrt(np.pi * radius @ radius / (1.0 - POROSITY)))
    xy = side * (np.outer(np.arange(1, IN_TILE + 1), [1.0 / PLASTIC, 1.0 / PLASTIC**2]) % 1.0)
    velocity = np.zeros_like(xy)
    for _ in range(ROUNDS):
        xy %= side
        a, b = cKDTree(xy, boxsize=side).query_pairs(2.5 * RADIUS * (1.0 + SPREAD), output_type="ndarray").T
        for _ in range(STEPS):
            branch = xy[b] - xy[a]
            branch -= side * np.rint(branch / side)
            distance = np.hypot(*branch.T)
            push = np.maximum(radius[a] + radius[b] - distance, 0.0)[:, None] * branch / distance[:, None]
            force = np.column_stack([np.bincount(b, push[:, k], IN_TILE) - np.bincount(a, push[:, k], IN_TILE) for k in range(2)])
            velocity = 0.93 * velocity + 0.15 * force
            xy += velocity
    return xy % side, radius, side


def dense_box(across, up, **effects):
    """Model and State of across x up tiles of soil at rest; effects: tables of the soil beside its springs."""
    xy, radius, side = tile()
    copies = [(i, j) for j in range(-1, up + 1) for i in range(-1, across + 1)]
    xy = np.concatenate([xy + side * np.array(copy) for copy in copies])
    radius = np.tile(radius, len(copies))
    low, high = -xy, xy - side * np.array([across, up])
    beyond = np.maximum(low, high).max(axis=1)  # distance outside the box, negative inside
    free = np.flatnonzero((xy >= 0.0).all(axis=1) & (high < 0.0).all(axis=1))
    held = np.setdiff1d(np.flatnonzero(beyond < 4.0 * RADIUS), free)
    free = free[in_strips(xy[free], 4.0 * RADIUS)]
    absent = dict.fromkeys(("friction", "bond", "rolling", "dashpot", "parallel_bond"))
    soil = SimpleNamespace(density=2000.0, spring=Spring(normal=5e7, shear=2e7), **absent | effects)
    discs = SimpleNamespace(soil=soil, stone=None, stiffness="disc", damping=Damping(local=0.7))
    return build_model(xy[held], radius[held], Packing(xy[free], radius[free]), discs, insitu=False)
