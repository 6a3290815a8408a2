"""Excavation and surcharge: total forces to round-off, and the elastic answer of a column.

A layer of weight q per area taken off a column of height H that cannot strain sideways lets it rise by q H / A1, A1 = K + 4G/3;
a pressure p upon it makes it settle by p H / A1. What is left is the stress of the column alone, plus the pressure.
"""

from types import SimpleNamespace

import numpy as np
import pytest
from zone_cases import DENSITY, GRAVITY, PAPER, box, settle, sides, slope, soil

from fdm_server.ground.load_ramps import pressure_forces, remove_zones, surcharge_ramp
from fdm_server.ground.load_steps import Ramp
from fdm_server.mesh.grid import build_grid, centroids
from fdm_server.mesh.grid_sides import surface_edges
from fdm_server.model import build_model, new_state
from fdm_server.observe import fields
from fdm_server.step.gridpoint_pass import unbalanced_ratio, update_velocities
from fdm_server.step.zone_pass import advance

A1 = PAPER.bulk + 4 * PAPER.shear / 3
HEIGHT = 6.0


def pressure(x, value):
    return SimpleNamespace(x=x, pressure=value)


def column():
    """A column of elastic soil at rest under its weight; displacements count from there."""
    scene = box(2.0, HEIGHT, 0.5, soil(), boundary=sides(left="x", right="x", bottom="y"))
    model = build_model(scene, build_grid(scene))
    state = new_state(model)
    settle(model, state, GRAVITY, 1e-10)
    state.displacement[:] = 0.0
    state.velocity[:] = 0.0
    return model, state


def follow(model, state, load, ratio=1e-10):
    """Take the steps of the load's ramp, then come to rest; returns the largest ratio on the way."""
    worst = 0.0
    for _ in range(load.ramp.over):
        load.apply(state)
        load.ramp.step_done()
        update_velocities(model, state, GRAVITY)
        advance(model, state)
        worst = max(worst, unbalanced_ratio(model, state, GRAVITY))
    settle(model, state, GRAVITY, ratio)
    return worst


@pytest.mark.parametrize("over", [1, 2000])
def test_the_ground_rises_when_a_layer_is_dug_away(over):
    model, state = column()
    layer = model.grid.row >= 8  # the upper two metres
    model, state, load = remove_zones(model, state, layer, GRAVITY, Ramp(over))
    worst = follow(model, state, load)
    left = HEIGHT - 2.0
    top = model.grid.xy[:, 1] == left
    np.testing.assert_allclose(state.displacement[top, 1], 2.0 * DENSITY * GRAVITY * left / A1, rtol=1e-7)
    middle = centroids(model.grid.xy, model.zones)[:, 1]
    np.testing.assert_allclose(fields.stress(model, state)[:, 1], -DENSITY * GRAVITY * (left - middle), rtol=1e-6)
    assert np.abs(state.applied).max() == 0.0
    assert worst > 0.1 if over == 1 else worst < 0.01  # gradual means gradual


def test_the_ground_settles_under_a_pressure_everywhere():
    model, state = column()
    follow(model, state, surcharge_ramp(model, state, pressure((0.0, 2.0), 80e3), ramp=Ramp(500)))
    top = model.grid.xy[:, 1] == HEIGHT
    np.testing.assert_allclose(state.displacement[top, 1], -80e3 * HEIGHT / A1, rtol=1e-7)


def test_surcharges_add_up():
    model, state = column()
    for part in ((0.0, 2.0), (0.0, 0.7), (0.7, 2.0)):
        surcharge_ramp(model, state, pressure(part, 40e3)).apply(state)
    np.testing.assert_allclose(state.applied[:, 1].sum(), -2 * 40e3 * 2.0, rtol=1e-12)
    settle(model, state, GRAVITY, 1e-10)
    top = model.grid.xy[:, 1] == HEIGHT
    np.testing.assert_allclose(state.displacement[top, 1], -80e3 * HEIGHT / A1, rtol=1e-7)


@pytest.mark.parametrize(("x", "rise"), [((0.3, 1.7), 0.0), ((2.1, 4.9), 2.8), ((1.0, 7.9), 3.0), ((5.25, 5.35), 0.0)])
def test_pressure_has_the_right_resultant_and_moment_wherever_it_ends(x, rise):
    """On level and inclined ground, through zones' sides: the force is (p dy, -p dx) of the surface between its ends; its moment,
    that of -p dx at the middle of the width and of p dy at half the rise."""
    scene = slope(0.5, soil())
    grid = build_grid(scene)
    force = pressure_forces(grid.xy, surface_edges(grid, grid.zones), pressure(x, 1e3))
    np.testing.assert_allclose(force.sum(axis=0), [1e3 * rise, -1e3 * (x[1] - x[0])], atol=1e-9)
    base = np.interp(x[0], (2, 5), (2, 5))
    moment = np.sum(grid.xy[:, 0] * force[:, 1] - grid.xy[:, 1] * force[:, 0])
    expected = -1e3 * (x[1] ** 2 - x[0] ** 2) / 2 - 1e3 * ((base + rise) ** 2 - base**2) / 2
    np.testing.assert_allclose(moment, expected, rtol=1e-12)
