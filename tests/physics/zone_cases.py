"""Small continua for tests: scenes without files, and the loop without stages."""

from types import SimpleNamespace

import numpy as np
from grid_cases import ELASTIC, material

from coupler_protocol.scene.tables.boundary import Boundary
from coupler_protocol.scene.tables.grid import Grid
from fdm_server.effects.damping import Damping
from fdm_server.step.gridpoint_pass import unbalanced_ratio, update_velocities
from fdm_server.step.zone_pass import advance

PAPER = ELASTIC  # Table 1 of the paper
DENSITY = 2700.0
GRAVITY = 9.81


def soil(elastic=PAPER, mohr_coulomb=None, tension=None, name="soil", **kept):
    """A material of a scene, elastic where nothing else is said; `kept`: softening, density [kg/m3], region, top."""
    return material(name, elastic=elastic, mohr_coulomb=mohr_coulomb, tension=tension, **kept)


def sides(**held):
    """Boundaries of a scene: sides(left="x", bottom="xy")."""
    return [Boundary(on=side, fix=fix) for side, fix in held.items()]


def box(length, height, zone_size, *materials, boundary=(), damping=0.8):
    """Scene of a box of zones."""
    grid = Grid(kind="box", length=length, height=height, zone_size=zone_size)
    return SimpleNamespace(grid=grid, material=materials, boundary=boundary, damping=Damping(local=damping))


def slope(zone_size, *materials, profile=((0, 2), (2, 2), (5, 5), (8, 5)), damping=0.8, **kept):
    """Scene of a slope on rollers, 8 x 5 m where no other profile is given; `kept` goes to the grid table."""
    grid = Grid(length=profile[-1][0], height=max(y for _, y in profile), zone_size=zone_size, profile=profile, **kept)
    boundary = sides(left="x", right="x", bottom="xy")
    return SimpleNamespace(grid=grid, material=materials, boundary=boundary, damping=Damping(local=damping))


def settle(model, state, gravity, ratio, most=100_000):
    """Take steps until the unbalanced ratio is reached; returns how many it took."""
    for step in range(1, most + 1):
        update_velocities(model, state, gravity)
        advance(model, state)
        if step % 50 == 0 and unbalanced_ratio(model, state, gravity) <= ratio:
            return step
    raise AssertionError(f"ratio {unbalanced_ratio(model, state, gravity):.2e} after {most} steps")


def stretch(model, state, gradient, steps=1):
    """Move all gridpoints by the displacement gradient (2,2) in equal steps, in equilibrium or not."""
    state.velocity[:] = model.grid.xy @ np.asarray(gradient, dtype=np.float64).T / steps
    for _ in range(steps):
        advance(model, state)
    state.velocity[:] = 0.0


def ring(inner, outer, around, *materials, boundary=(), damping=0.8, **kept):
    """Scene of zones around a hole; `kept` goes to the grid table."""
    grid = Grid(kind="ring", inner=inner, outer=outer, around=around, **kept)
    return SimpleNamespace(grid=grid, material=materials, boundary=boundary, damping=Damping(local=damping))
