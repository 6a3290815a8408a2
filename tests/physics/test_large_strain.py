"""Large strain: stress turns with its zone, a turn is no strain, and strains of any size add up as logarithms.

Closed forms for a material that obeys the Jaumann rate of Hooke's law. Uniaxial stretch to lambda: sigma_xx = (K + 4G/3) ln
lambda, the others (K - 2G/3) ln lambda. Simple shear gamma: sigma_xy = G sin gamma, sigma_xx = -sigma_yy = G (1 - cos gamma)
(Dienes 1979, Acta Mechanica 32, 217-232).
"""

from math import cos, log, sin

import numpy as np
import pytest
from verification.continuum import spin
from zone_cases import DENSITY, GRAVITY, PAPER, box, settle, sides, soil

from fdm_server.mesh.grid import build_grid
from fdm_server.model import build_model, new_state
from fdm_server.observe import fields
from fdm_server.step.gridpoint_pass import update_velocities
from fdm_server.step.present_shape import MASS_STEPS, begin_large_strain, masses
from fdm_server.step.safety import Unstable
from fdm_server.step.stress import SD, SM, XY, ZZ
from fdm_server.step.zone_pass import advance

K, G = PAPER.bulk, PAPER.shear
A1, A2 = K + 4 * G / 3, K - 2 * G / 3


def distorted_box():
    """Nine zones, inner gridpoints shaken, of elastic soil that nothing holds; in large strain."""
    scene = box(3.0, 3.0, 1.0, soil())
    grid = build_grid(scene)
    inside = ((grid.xy > 0.5) & (grid.xy < 2.5)).all(axis=1)
    shake = np.random.default_rng(3).uniform(-0.2, 0.2, grid.xy.shape) * inside[:, None]
    model = build_model(scene, grid._replace(xy=grid.xy + shake))
    state = new_state(model)
    begin_large_strain(model, state)
    return model, state


def follow(model, state, place, steps):
    """Move gridpoints along place(t, xy) for t from 0 to 1, in so many steps, and let them stand."""
    for _ in spin.follow(model, state, place, steps):
        pass
    state.velocity[:] = 0.0


def turning(angle):
    """A rigid turn about a point outside."""

    def place(t, xy):
        c, s = cos(t * angle), sin(t * angle)
        return (xy - [7.0, -2.0]) @ np.array([[c, s], [-s, c]])

    return place


def set_stress(state, xx, yy, zz, xy):
    """The same stress [Pa] in all zones."""
    for row, rows, value in ((SM, 1, 0.5 * (xx + yy)), (ZZ, 1, zz), (SD, 4, 0.5 * (xx - yy)), (XY, 4, xy)):
        state.stress[:, row : row + 16 * rows] = value


@pytest.mark.parametrize("steps", [50_000, 7])
def test_stress_turns_with_a_zone_by_a_right_angle(steps):
    """In steps of any size: the angle of a rigid turn is found exactly."""
    model, state = distorted_box()
    set_stress(state, -3e5, -8e5, -4e5, 1e5)
    follow(model, state, turning(0.5 * np.pi), steps)
    np.testing.assert_allclose(fields.stress(model, state), np.tile([-8e5, -3e5, -4e5, -1e5], (9, 1)), rtol=1e-8)


def test_a_turn_leaves_no_stress():
    model, state = distorted_box()
    follow(model, state, turning(2.0), 300)
    assert np.abs(state.stress).max() < 1e-11 * G
    np.testing.assert_allclose(fields.shear_strain(model, state), 0.0, atol=1e-12)


def test_small_strain_takes_a_turn_for_strain():
    """What large strain is for: without it, ten degrees of a turn are 3 % of strain."""
    model, state = distorted_box()
    state.mass = None
    follow(model, state, turning(np.radians(10)), 100)
    assert np.abs(state.stress).max() > 0.01 * G


def errors(place, exact, steps):
    """Largest error of the stress at t = 1, over G, for each number of steps."""
    found = []
    for count in steps:
        model, state = distorted_box()
        follow(model, state, place, count)
        found.append(np.abs(fields.stress(model, state) - exact).max() / G)
    return found


def test_uniaxial_stretch_gives_the_logarithmic_strain():
    exact = np.array([A1, A2, A2, 0.0]) * log(3.0)
    coarse, fine = errors(lambda t, xy: xy * [1 + 2 * t, 1], exact, (100, 1000))
    assert fine < 1e-5
    assert coarse / fine == pytest.approx(100.0, rel=0.1)  # second order


def test_uniaxial_compression_to_a_third():
    exact = np.array([A2, A1, A2, 0.0]) * log(1 / 3)
    assert errors(lambda t, xy: xy * [1, 1 - 2 / 3 * t], exact, (2000,))[0] < 1e-5


def test_simple_shear_swings_as_the_jaumann_rate_must():
    gamma = 4.0
    exact = np.array([1 - cos(gamma), cos(gamma) - 1, 0.0, sin(gamma)]) * G
    coarse, fine = errors(lambda t, xy: xy + np.outer(xy[:, 1], [t * gamma, 0]), exact, (100, 1000))
    assert fine < 1e-5
    assert coarse / fine == pytest.approx(100.0, rel=0.1)


def test_recorded_shear_strain_is_the_difference_of_logarithmic_strains():
    model, state = distorted_box()
    follow(model, state, lambda t, xy: turning(1.0)(t, xy * [1 + t, 1 - t / 2]), 200)
    np.testing.assert_allclose(fields.shear_strain(model, state), log(2.0) - log(0.5), rtol=1e-12)


def test_a_soft_column_carries_its_weight_in_its_settled_shape():
    """With lambda the stretch and rho_0 the first density: rho_0 g (H - Y) = -A1 ln(lambda), so the top sinks by
    H - (A1/rho_0 g)(1 - exp(-rho_0 g H/A1))."""
    soft = type(PAPER)(bulk=2e6, shear=0.6e6)
    scene = box(2.0, 10.0, (1.0, 0.25), soil(soft), boundary=sides(left="x", right="x", bottom="y"))
    model = build_model(scene, build_grid(scene))
    state = new_state(model)
    begin_large_strain(model, state)
    settle(model, state, GRAVITY, 1e-9)
    stiffness = soft.bulk + 4 * soft.shear / 3
    length = stiffness / (DENSITY * GRAVITY)
    exact = 10.0 - length * (1 - np.exp(-10.0 / length))
    top = model.grid.xy[:, 1] == 10.0
    assert exact > 0.4
    np.testing.assert_allclose(-state.displacement[top, 1], exact, rtol=2e-4)


def test_masses_follow_the_shape_and_scaled_steps_stay_stable():
    """A box drawn to five times its length: masses for the thin zones, and undamped vibration that does not grow."""
    scene = box(2.0, 2.0, 0.5, soil(), boundary=sides(left="x", bottom="y"), damping=0.0)
    model = build_model(scene, build_grid(scene))
    state = new_state(model)
    begin_large_strain(model, state)
    follow(model, state, lambda t, xy: xy * [1 + 4 * t, 1], 50 * MASS_STEPS)
    assert masses(model, state).min() == pytest.approx(2.6 * model.mass.min(), rel=1e-9)
    state.stress[:] = 0.0
    advance(model, state)
    state.velocity[:] = 1e-6 * np.random.default_rng(1).standard_normal(state.velocity.shape)
    for _ in range(3000):
        update_velocities(model, state, 0.0)
        advance(model, state)
    assert np.abs(state.velocity).max() < 1e-5


def test_a_zone_that_turns_inside_out_is_named():
    model, state = distorted_box()
    corner = np.argmax(model.grid.xy.sum(axis=1))
    state.velocity[corner] = [-0.4, -0.4]
    advance(model, state)
    state.velocity[corner] = [-0.2, -0.2]
    with pytest.raises(Unstable, match=r"1 zones are inverted .* zone 8 at \("):
        advance(model, state)
