"""Virtual strain brings a window to a given stress field, and bonds put there do not break."""

import numpy as np
import pytest
import shapely
from window_case import OBLIQUE, SQUARE, packed, soil_discs

from coupler_protocol.geometry import polygon_area
from coupler_protocol.problems import SceneError
from dem_server.effects.bond import BONDED
from dem_server.insitu import virtual_strain
from dem_server.insitu.hat_bins import bins_over
from dem_server.insitu.packing_strength import friction_sine
from dem_server.observe.unbalanced_ratio import unbalanced_ratio
from dem_server.pairs import contacts
from dem_server.step import bonds_made
from dem_server.step.contact_pass import contact_forces
from dem_server.step.motion import move_free

K0, DENSITY, GRAVITY, TOP = 0.571, 2700.0, 9.81, 5.0


def level_ground(corners, K=K0):
    """Zones (z, 7) under a level surface at y = TOP that fill the polygon; K = xx / yy."""
    points = bins_over(corners, 0.125).points
    syy = -DENSITY * GRAVITY * (TOP - points[:, 1])
    area = np.full(len(points), polygon_area(corners) / len(points))
    density = np.full(len(points), DENSITY)
    return np.column_stack([points, area, K * syy, syy, 0.0 * syy, density])


@pytest.fixture(scope="module", params=[SQUARE, OBLIQUE], ids=["square", "oblique"])
def brought(request):
    model, state = packed(request.param, soil_discs())
    target = level_ground(request.param)
    virtual_strain.match_weight(model, state, target)
    return model, state, target, virtual_strain.bring_to_stress(model, state, target, GRAVITY)


def test_stress_and_reactions(brought):
    model, state, target, report = brought
    assert max(report.error_xx, report.error_yy, report.error_xy) <= 0.05
    assert report.projected == 0.0
    assert report.ratio <= 1e-6
    x, force = state.x[: model.ring], state.force[: model.ring]
    middle = x.mean(axis=0)
    expected = target[:, 2] @ target[:, 3:5]
    moments = -((x - middle) * force).sum(axis=0)  # integral of the stress, and the weight's lever
    free = slice(model.ring, None)
    moments[1] -= GRAVITY * state.weight[free] @ (state.x[free, 1] - middle[1])
    np.testing.assert_allclose(moments, expected, rtol=0.04)


def test_weight_is_that_of_the_zones(brought):
    model, state, target, _ = brought
    assert state.weight.sum() == pytest.approx(target[:, 2] @ target[:, 6], rel=1e-12)
    reaction = -state.force[: model.ring, 1].sum()
    assert reaction == pytest.approx(GRAVITY * state.weight[model.ring :].sum(), rel=1e-4)


def test_zones_without_stress_are_refused():
    """Errors are shares of the zones' stress: without any there is nothing to bring the discs to."""
    model, state = packed(OBLIQUE, soil_discs())
    target = level_ground(OBLIQUE)
    target[:, 3:6] = 0.0
    with pytest.raises(SceneError, match=r"carry no stress[^!]*insitu = false"):
        virtual_strain.bring_to_stress(model, state, target, 0.0)


def test_bonds_added_afterwards_hold(brought):
    model, state, _, _ = brought
    bonds_made.add_bonds(model, state)
    pairs = contacts(state)
    assert (pairs.bond_state == BONDED).mean() > 0.95
    assert ((pairs.disc_a < model.ring) & (pairs.bond_state == BONDED)).any()
    for _ in range(500):
        move_free(model, state, GRAVITY)
        contact_forces(model, state)
    assert state.broken_tension + state.broken_shear == 0
    assert unbalanced_ratio(model, state, GRAVITY) < 1e-6


@pytest.mark.parametrize("height", [0.35, 0.8, 3.0])
def test_measuring_circles_lie_in_the_window(height):
    corners = np.array([[0.0, 0.0], [3.0, 0.5], [3.0, 0.5 + height], [0.0, height]])
    centres, radius = virtual_strain.measuring_circles(corners, 0.25)
    edge = shapely.Polygon(corners).exterior
    assert all(edge.distance(shapely.Point(centre)) > 0.999 * radius for centre in centres)
    assert radius <= 0.25
    assert len(centres) > 1 or height < 0.6


def test_bonds_carry_what_friction_cannot():
    """K = 0.36 lies outside the cone of friction alone and inside that of the bonded packing."""
    target = level_ground(SQUARE, K=0.36)
    reports = []
    for bond in (True, False):
        model, state = packed(SQUARE, soil_discs(bond=bond))
        virtual_strain.match_weight(model, state, target)
        reports.append(virtual_strain.bring_to_stress(model, state, target, GRAVITY))
        if bond:
            bonds_made.add_bonds(model, state)
            assert state.broken_tension + state.broken_shear == 0
            move_free(model, state, GRAVITY)
            contact_forces(model, state)
            assert state.broken_tension + state.broken_shear == 0
    bonded, loose = reports
    assert bonded.projected == 0.0
    assert max(bonded.error_xx, bonded.error_yy, bonded.error_xy) <= 0.06
    assert loose.projected == 1.0


def test_stress_that_was_cut_off_is_an_error_against_the_zones():
    """K = 0.36 has a sine of 0.47; without bonds the discs carry at most that of their friction, 0.41."""
    target = level_ground(SQUARE, K=0.36)
    model, state = packed(SQUARE, soil_discs(bond=None))
    virtual_strain.match_weight(model, state, target)
    aim = virtual_strain.aim_of(model, state, target)
    report = virtual_strain.bring_to_stress(model, state, target, GRAVITY)
    found = virtual_strain.against_zones(state, aim)
    assert found["sine_zones"] == pytest.approx(0.64 / 1.36, abs=1e-3)
    assert 0.25 < found["sine_discs"] < friction_sine(model) < 0.9 * found["sine_zones"]
    assert found["zones_xx"] > 1.3 * report.error_xx
    assert found["zones_yy"] > 1.3 * report.error_yy


def test_the_mobilised_sine_does_not_depend_on_axes():
    stress = np.array([[-1.0, -3.0, 0.0], [-2.0, -2.0, 1.0], [-2.0, -2.0, -1.0]])
    assert virtual_strain.mobilised_sine(stress) == pytest.approx(0.5)
    assert np.isnan(virtual_strain.mobilised_sine(-stress))


def test_bins_share_out_the_whole_window():
    grid = bins_over(OBLIQUE, 0.24)
    assert grid.area().sum() == pytest.approx(polygon_area(OBLIQUE), rel=1e-12)
    weights = grid.weights(np.random.default_rng(0).random((50, 2)))
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, rtol=1e-14)
