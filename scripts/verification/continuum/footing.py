"""Rough strip footings on weightless ground: Tresca, without mixed discretisation, and with friction.

Half of a footing of half-width a = 1 m on a box of ground, K = 0.2 GPa, G = 0.1 GPa; gridpoints under it are pushed down at a
constant velocity and held horizontally. Pressure is the reaction over a + h/2, h = zone size: the edge of the footing is half
a zone beyond its last gridpoint. Prandtl's pressure at collapse:

    c = 100 kPa, phi = 0:            p = (2 + pi) c                                       box of 5a x 3a
    c = 100 kPa, phi = psi = 20:     p = c cot phi (exp(pi tan phi) tan^2(45 + phi/2) - 1)  box of 8a x 5a

A collapse mechanism gives an upper bound, so values lie above the reference. Without mixed discretisation (overlaid
triangles), incompressible flow locks: the pressure is too high and continues to grow, and the footing never collapses."""

from math import exp, pi, radians, tan

import numpy as np

from colluvium import Scene
from fdm_server.ground.boundaries_in_time import begin_stage
from fdm_server.mesh.grid import build_grid
from fdm_server.mesh.grid_sides import side_of
from fdm_server.model import build_model, new_state
from fdm_server.step.gridpoint_pass import update_velocities
from fdm_server.step.zone_pass import advance
from verification import as_a_run
from verification.continuum.meshes import without_mixing
from verification.verdict_rows import row

NAME = "strip footing"
SOURCE = "Prandtl (1920)"
K, G, COHESION = 0.2e9, 0.1e9, 0.1e6
OVER = 500  # steps until the footing has its velocity


def prandtl(friction):
    """Pressure at collapse over cohesion, friction angle in degrees."""
    if friction == 0.0:
        return 2.0 + pi
    t = tan(radians(friction))
    return (exp(pi * t) * tan(radians(45.0 + friction / 2.0)) ** 2 - 1.0) / t


def scene(parts, friction, box, depth, velocity):
    """The footing with `parts` zones under its half on a box of (length, height) m, pressed `depth` m deep."""
    push = {"on": "top", "name": "footing", "x": [0.0, 1.0], "velocity": {"x": 0.0, "y": -velocity}, "over": OVER}
    return as_a_run.tables(
        {"kind": "box", "length": box[0], "height": box[1], "zone_size": 1.0 / parts},
        as_a_run.material(K, G, mohr_coulomb={"friction": friction, "cohesion": COHESION, "dilation": friction}),
        [{"name": "press", "kind": "load", "boundary": [push], "until": {"steps": round(depth / velocity)}}],
        {"left": "x", "right": "x", "bottom": "xy"},
    )


def pressure(reactions, parts):
    """Pressure over cohesion: mean of the last tenth of the reactions [N]."""
    return reactions[-len(reactions) // 10 :].mean() / (COHESION * (1.0 + 0.5 / parts))


def collapse(parts, friction=0.0, box=(5.0, 3.0), depth=0.06, velocity=5e-6):
    """Pressure over cohesion at the end of the way."""
    found = as_a_run.compute(scene(parts, friction, box, depth, velocity), ["reaction_y:footing"])
    return pressure(-found.histories["reaction_y:footing"], parts)


def locked(parts, depth=0.06, velocity=5e-6):
    """The same for Tresca without mixed discretisation, which no scene can ask for: steps taken here."""
    tables = Scene(**scene(parts, 0.0, (5.0, 3.0), depth, velocity))
    model = build_model(tables, build_grid(tables))
    model, _ = begin_stage(tables, 0, model, new_state(model))
    foot = side_of(model.grid, "top")
    foot = foot[model.grid.xy[foot, 0] < 1.0 + 1e-9]
    model = without_mixing(model)
    state = new_state(model)
    reactions = np.empty(round(depth / velocity))
    for step in range(len(reactions)):
        update_velocities(model, state, 0.0)
        state.velocity[foot, 1] = -velocity
        advance(model, state)
        reactions[step] = 0.5 * state.force[foot, 1].sum()  # twice as thick
    return pressure(reactions, parts)


def rows(fast):
    """a/4, a/8 and a/16 (fast: the two coarse ones; friction with a/4)."""
    for parts in (4, 8) if fast else (4, 8, 16):
        yield row(f"p/c, Tresca, a/{parts}", collapse(parts), prandtl(0.0), [0.0, 0.03], SOURCE)
    yield row("p/c without mixed discretisation, a/4: locks", locked(4), prandtl(0.0), [0.3, 10.0], SOURCE)
    parts = 4 if fast else 8
    found = collapse(parts, 20.0, box=(8.0, 5.0), depth=0.1, velocity=1e-5)
    yield row(f"p/c, friction 20 degrees, a/{parts}", found, prandtl(20.0), [0.0, 0.03], SOURCE)
