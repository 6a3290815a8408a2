"""Rough strip footings on weightless ground: Tresca, without mixed discretisation, and with friction.

Half of a footing of half-width a = 1 m on a box of ground, K = .2 GPa, G = .1 GPa; gridpoints under it are pushed down at a
constant velocity and held sideways. Pressure is the reaction over a + h/2, h = zone size: the edge of the footing lies half a
zone beyond its last gridpoint. Prandtl's pressure at collapse:

    c = 100 kPa, phi = 0:            p = (2 + pi) c                                       box of 5a x 3a
    c = 100 kPa, phi = psi = 20:     p = c cot phi (exp(pi tan phi) tan^2(45 + phi/2) - 1)  box of 8a x 5a

A velocity field that collapses can only give more, so values lie above. Without mixed discretisation (overlaid triangles) the
flow without change of volume finds too few ways: the pressure stays too high and grows on, the footing never collapses.
"""

from dataclasses import replace
from math import exp, pi, radians, tan

import numpy as np

from colluvium import Scene
from fdm_server.advance import advance
from fdm_server.grid import build_grid
from fdm_server.model import build_model, new_state
from fdm_server.motion import update_velocities
from verification import product
from verification.continuum.meshes import without_mixing
from verification.rows import row

NAME = "strip footing"
SOURCE = "Prandtl (1920)"
K, G, COHESION = 0.2e9, 0.1e9, 0.1e6


def prandtl(friction):
    """Pressure at collapse over cohesion, friction angle in degrees."""
    if friction == 0.0:
        return 2.0 + pi
    t = tan(radians(friction))
    return (exp(pi * t) * tan(radians(45.0 + friction / 2.0)) ** 2 - 1.0) / t


def collapse(parts, friction=0.0, mixed=True, box=(5.0, 3.0), depth=0.06, velocity=5e-6):
    """Pressure over cohesion, mean of the last tenth of a settlement of `depth` m, with `parts` zones under half the footing."""
    law = {"friction": friction, "cohesion": COHESION, "dilation": friction}
    grid = {"kind": "box", "length": box[0], "height": box[1], "zone_size": 1.0 / parts}
    held = {"left": "x", "right": "x", "bottom": "xy"}
    scene = Scene(**product.tables(grid, product.material(K, G, mohr_coulomb=law), product.IDLE, held))
    model = build_model(scene, build_grid(scene))
    x, y = model.grid.xy.T
    foot = (y > box[1] - 1e-9) & (x < 1.0 + 1e-9)
    if not mixed:
        model = without_mixing(model)
    model = replace(model, fixed=model.fixed | (foot[:, None] & [True, False]))
    state = new_state(model)
    steps = round(depth / velocity)
    force = np.empty(steps)
    for step in range(steps):
        update_velocities(model, state, 0.0)
        state.velocity[foot, 1] = -velocity
        advance(model, state)
        force[step] = state.force[foot, 1].sum()
    thickness = 1.0 if mixed else 2.0
    return force[-steps // 10 :].mean() / (thickness * COHESION * (1.0 + 0.5 / parts))


def rows(fast):
    """a/4, a/8 and a/16 (fast: the two coarse ones; friction with a/4)."""
    for parts in (4, 8) if fast else (4, 8, 16):
        yield row(f"p/c, Tresca, a/{parts}", collapse(parts), prandtl(0.0), [0.0, 0.03], SOURCE)
    locked = collapse(4, mixed=False)
    yield row("p/c without mixed discretisation, a/4: locks", locked, prandtl(0.0), [0.3, 10.0], SOURCE)
    parts = 4 if fast else 8
    pressure = collapse(parts, 20.0, box=(8.0, 5.0), depth=0.1, velocity=1e-5)
    yield row(f"p/c, friction 20 degrees, a/{parts}", pressure, prandtl(20.0), [0.0, 0.03], SOURCE)
