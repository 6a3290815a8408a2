"""Zones as finite elements: stiffness without hourglass modes, masses with a margin, forces that balance."""

from dataclasses import replace

import numpy as np
import pytest
from grid_cases import material, slope
from stiffness_by_steps import BENCH, SOFT, elastic_slope, highest, stiffness

from fdm_server.effects.elastic import Elastic
from fdm_server.mesh.grid import build_grid
from fdm_server.model import build_model, new_state
from fdm_server.step.blocks import from_blocks, to_blocks
from fdm_server.step.gridpoint_pass import unbalanced_ratio, update_velocities
from fdm_server.step.safety import Unstable, check_motion, check_zones
from fdm_server.step.zone_pass import advance

NOTHING = {"mohr_coulomb": None, "tension": None}


@pytest.fixture(scope="module")
def one_zone():
    scene = slope(1.0, [(0, 1), (1, 1)], length=1.0, height=1.0, materials=SOFT)
    grid = build_grid(scene)
    xy = np.array([[0.0, 0.1], [1.2, 0.0], [-0.1, 0.9], [1.0, 1.3]])
    scene.boundary = []
    return build_model(scene, grid._replace(xy=xy))


def test_stiffness_is_symmetric_and_only_rigid_motion_is_free(one_zone):
    K = stiffness(one_zone)
    values = np.linalg.eigvalsh(K) / np.abs(K).max()
    np.testing.assert_allclose(K, K.T, atol=1e-9 * np.abs(K).max())
    assert np.abs(values[:3]).max() < 1e-12
    assert values[3] > 1e-2


def test_a_zone_neither_pushes_nor_turns_itself(one_zone):
    state = new_state(one_zone)
    state.velocity[:] = np.random.default_rng(2).normal(size=(4, 2))
    advance(one_zone, state)
    x, y = one_zone.grid.xy.T
    scale = np.abs(state.force).max()
    assert np.abs(state.force.sum(axis=0)).max() < 1e-12 * scale
    assert abs(np.sum(x * state.force[:, 1] - y * state.force[:, 0])) < 1e-12 * scale


@pytest.mark.parametrize("shake", [0.0, 0.6])
@pytest.mark.parametrize("elastic", [Elastic(bulk=0.5e9, shear=0.15e9), Elastic(bulk=1e9, shear=1e6)])
def test_static_masses_leave_room_for_local_damping(elastic, shake):
    """omega^2 < 4/(1 + alpha) at a step of 1, for regular and distorted zones and up to nu = .4995."""
    model = elastic_slope(elastic, shake)
    mass = np.repeat(model.mass, 2)
    omega2 = np.linalg.eigvalsh(stiffness(model) / np.sqrt(mass[:, None] * mass)).max()
    assert omega2 * (1 + 0.8) / 4 < 0.95


LIMIT = 4.0 / (1.0 + 0.8)  # of omega^2 under local or combined damping of 0.8


def test_no_shape_of_triangle_exceeds_half_of_what_masses_hold():
    """One triangle alone carries its masses from both overlaid pairs: omega^2 <= 2 for any shape and any Poisson's ratio."""
    rng = np.random.default_rng(8)
    scene = slope(1.0, [(0, 1), (1, 1)], length=1.0, height=1.0)
    scene.boundary = []
    worst = 0.0
    for _ in range(150):
        nu = rng.choice([-0.5, 0.0, 0.3, 0.49, 0.4999])
        shear = 1e6
        scene.material = [material(elastic=Elastic(bulk=shear * 2 * (1 + nu) / (3 * (1 - 2 * nu)), shear=shear), **NOTHING)]
        grid = build_grid(scene)
        xy = np.array([[0.0, 0.0], [1.0, 0.0], [rng.uniform(-1, 2), 10.0 ** rng.uniform(-2, 1)], [5.0, 5.0]])
        zones = np.array([[0, 1, 2, 2]])
        model = build_model(scene, grid._replace(xy=xy, zones=zones))
        worst = max(worst, highest(model))
    assert worst < 2.0 < LIMIT


@pytest.mark.parametrize("contrast", [1e-3, 1e3])
@pytest.mark.parametrize("thin", [1.0, 8.0])
def test_masses_hold_for_layers_of_any_contrast_thin_distorted_zones_and_springs(contrast, thin):
    """Quads and triangles, 1000:1 in stiffness, eight times as long as wide, shaken, and with the springs of an interface."""
    stiff, soft = Elastic(bulk=0.5e9, shear=0.15e9), Elastic(bulk=0.5e9 * contrast, shear=0.15e9 * contrast)
    layer = material("layer", [(0, 0), (20, 0), (20, 4), (0, 4)], elastic=soft, **NOTHING)
    scene = slope(2.0, BENCH, materials=[material(elastic=stiff, **NOTHING), layer])
    grid = build_grid(scene)
    rng = np.random.default_rng(5)
    free = ~build_model(scene, grid).fixed.any(axis=1)
    xy = (grid.xy + 0.5 * free[:, None] * rng.uniform(-1, 1, grid.xy.shape)) * [thin, 1.0]
    model = build_model(scene, grid._replace(xy=xy))
    assert highest(model) < 0.5 * LIMIT
    springs = model.mass * 10.0 ** rng.uniform(-2, 3, len(model.mass)) * (rng.random(len(model.mass)) < 0.3)
    assert highest(model, springs) < LIMIT


def test_weights_stand_for_the_zones(one_zone):
    """The gridpoints of a zone weigh what it weighs, and their centre of mass is its centroid."""
    x, y = one_zone.grid.xy[one_zone.zones[0]].T
    x1, y1 = np.roll(x, -1), np.roll(y, -1)
    cross = x * y1 - x1 * y
    mass = one_zone.weight_mass[one_zone.zones[0]]
    assert mass.sum() == pytest.approx(2700 * cross.sum() / 2, rel=1e-12)
    assert mass @ x == pytest.approx(2700 * np.sum((x + x1) * cross) / 6, rel=1e-12)
    assert mass @ y == pytest.approx(2700 * np.sum((y + y1) * cross) / 6, rel=1e-12)
    assert elastic_slope().weight_mass.sum() == pytest.approx(2700 * (240 - 32 - 8 * 4), rel=1e-12)


def test_added_mass_slows_and_held_components_stay():
    model = elastic_slope()
    model = replace(model, law=model.law._replace(damping=None))
    state = new_state(model)
    state.added_mass[:] = model.mass
    update_velocities(model, state, 9.81)
    free = ~model.fixed
    expected = -9.81 * model.weight_mass / (2 * model.mass)
    np.testing.assert_allclose(state.velocity[:, 1], np.where(free[:, 1], expected, 0.0), rtol=1e-14)
    assert not state.velocity[:, 0].any()


def test_ratio_of_a_model_at_rest_under_gravity_is_that_of_its_weights():
    model = elastic_slope()
    free = ~model.fixed.all(axis=1)
    weight = model.weight_mass[free]
    largest = weight[~model.fixed[free, 1]].max()
    assert unbalanced_ratio(model, new_state(model), 9.81) == pytest.approx(largest / weight.mean(), rel=1e-12)
    assert unbalanced_ratio(model, new_state(model), 0.0) == 0.0


def test_a_failed_state_has_no_ratio_that_ends_a_stage():
    model = elastic_slope()
    state = new_state(model)
    state.corner_force[0] = np.nan
    assert np.isnan(unbalanced_ratio(model, state, 9.81))


def test_blocks_keep_values():
    values = np.arange(37 * 3).reshape(37, 3)
    assert to_blocks(values).shape == (3, 48)
    assert np.array_equal(from_blocks(to_blocks(values), 37), values)


def test_failures_are_named():
    model = elastic_slope()
    state = new_state(model)
    check_motion(model, state)
    state.velocity[7, 1] = np.nan
    with pytest.raises(Unstable, match=r"1 gridpoints are NaN or infinite, one at \("):
        check_motion(model, state)
    state.velocity[7, 1] = 1e6
    with pytest.raises(Unstable, match="more than the size of the grid"):
        check_motion(model, state)
    with pytest.raises(Unstable, match="inverted"):
        check_zones(model.grid.xy * [-1, 1], model.zones, model.zone)


def test_gridpoints_without_a_position_are_named_with_their_zone():
    """Not as inverted zones at (nan, nan)."""
    xy = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.0, 1.0], [1.0, 1.0], [2.0, 1.0]])
    zones = np.array([[0, 1, 4, 3], [1, 2, 5, 4]])
    check_zones(xy, zones, np.array([7, 8]))
    xy[5, 1] = np.nan
    with pytest.raises(Unstable, match=r"positions of 1 gridpoints .* number 5, a corner of zone 8 near \(1\.333, 0\.3333\)"):
        check_zones(xy, zones, np.array([7, 8]))
    xy[:] = np.nan
    with pytest.raises(Unstable, match="positions of 6 gridpoints are NaN or infinite: the step"):
        check_zones(xy, zones, np.array([7, 8]))
