"""Packings: stress, porosity, coordination in windows of any shape; one seed, one packing."""

import numpy as np
import pytest
import shapely
from window_case import ANGLE, OBLIQUE, SQUARE, packed, packing_of, rim, soil_discs

from coupler_protocol.geometry import polygon_area
from coupler_protocol.interface.ring import build_ring
from coupler_protocol.problems import SceneError
from coupler_protocol.scene.tables.grading import Grading
from dem_server.effects.spring import Spring
from dem_server.insitu.contact_stress import mean_stress
from dem_server.observe.coordination import coordination, porosity
from dem_server.observe.unbalanced_ratio import unbalanced_ratio
from dem_server.packing.alone_window import rim_of
from dem_server.packing.growth import TOLD, run
from dem_server.packing.packing import in_strips, pack, settle, spread_points
from dem_server.pairs import contacts
from dem_server.step.contact_pass import contact_forces
from dem_server.step.motion import move_free


def rested(corners, discs):
    """A packed window after friction has taken hold."""
    model, state = packed(corners, discs)
    for _ in range(1000):
        move_free(model, state, 0.0)
        contact_forces(model, state)
    return model, state


@pytest.mark.parametrize("how", ["relaxed", "inward"])
@pytest.mark.parametrize("corners", [SQUARE, OBLIQUE, ANGLE], ids=["square", "oblique", "angle"])
def test_a_packing_is_dense_and_at_its_stress(corners, how):
    model, state = rested(corners, soil_discs(packing=how))
    stress = mean_stress(contacts(state), polygon_area(corners))
    assert -0.5 * (stress[0] + stress[1]) == pytest.approx(100e3, rel=0.03)
    assert unbalanced_ratio(model, state, 0.0) < 1e-6
    assert 0.15 < porosity(model, state) < 0.175
    assert shapely.contains_xy(shapely.Polygon(corners), state.x[model.ring :]).all()


@pytest.mark.parametrize("how", ["relaxed", "inward"])
def test_the_papers_window(how):
    """2 m x 5.667 m, discs of 0.05 m (0.03 m gives the same figures within 0.003, 4.20-4.25 and 0.6 %)."""
    corners = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 17.0 / 3.0], [0.0, 17.0 / 3.0]])
    model, state = rested(corners, soil_discs(radius=0.05, packing=how))
    stress = mean_stress(contacts(state), polygon_area(corners))
    assert -0.5 * (stress[0] + stress[1]) == pytest.approx(100e3, rel=0.03)
    assert np.hypot(0.5 * (stress[0] - stress[1]), stress[2]) < 7e3  # nearly the same in all directions
    assert 0.153 < porosity(model, state) < 0.162
    inner = shapely.contains_xy(shapely.Polygon(corners).buffer(-0.2), state.x)
    number, loose = coordination(model, state, inner)
    assert 4.15 < number < 4.35
    assert loose <= 0.012


def test_stiffer_discs_come_closer_to_the_isostatic_coordination():
    model, soft = packed(SQUARE, soil_discs())
    _, hard = packed(SQUARE, soil_discs(confinement=30e3))
    assert 3.7 < coordination(model, hard)[0] < coordination(model, soft)[0]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_stiff_discs_reach_their_confinement(seed):
    """27 times the stiffness of the paper's soil: loose discs that grew by 1 % sent the stress beyond 100 kPa."""
    discs = soil_discs(radius=0.035)
    discs.soil.spring = Spring(normal=1.35e9, shear=5.4e8)
    ring = build_ring(rim_of([[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [0.0, 2.0]], 0.14), discs.radius)
    found = pack(ring.nodes, ring.xy, ring.radius, discs, np.random.default_rng([seed, 1]))
    assert found.pressure == pytest.approx(100e3, rel=0.01)
    assert 0.16 < found.porosity < 0.18


def test_stiff_discs_rearrange_for_longer_and_reach_a_small_confinement_too():
    """Contacts of 1.5 GN/m under 50 kPa: the stress wanders for more than a hundred growths before the discs carry it."""
    discs = soil_discs(radius=0.035, confinement=50e3)
    discs.soil.spring = Spring(normal=3e9, shear=3e8)
    ring = build_ring(rim_of([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], 0.14), discs.radius)
    found = pack(ring.nodes, ring.xy, ring.radius, discs, np.random.default_rng([4, 1]))
    assert found.pressure == pytest.approx(50e3, rel=0.01)


def test_radii_follow_the_scene():
    model, state = packed(SQUARE, soil_discs(spread=0.1))
    radius = state.radius[model.ring :]
    assert radius.max() / radius.min() < 1.1 / 0.9 * 1.2
    assert radius.mean() == pytest.approx(0.03, rel=0.03)


CIRCLE = 0.75 * np.column_stack([np.cos(np.arange(24) * np.pi / 12.0), np.sin(np.arange(24) * np.pi / 12.0)])
TOE = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.4], [1.4, 1.4], [0.6, 0.6], [0.0, 0.6]])  # of a slope, 45 degrees
SHAPES = {"oblique": OBLIQUE, "L": ANGLE, "circle": CIRCLE, "toe": TOE}


@pytest.mark.parametrize("how", ["relaxed", "inward"])
@pytest.mark.parametrize("shape", SHAPES)
def test_a_porosity_is_reached_exactly_in_any_polygon(shape, how):
    discs = soil_discs(packing=how, target="porosity", porosity=0.15)
    found = packing_of(SHAPES[shape], discs)
    model, state = found.model, found.state
    assert porosity(model, state) == pytest.approx(0.15, abs=1e-12)
    assert shapely.contains_xy(shapely.Polygon(SHAPES[shape]), state.x[model.ring :]).all()
    number, few = coordination(model, state)
    assert 4.0 < number < 4.5
    assert few < 0.02
    stress = mean_stress(contacts(state), polygon_area(found.nodes))
    assert -0.5 * (stress[0] + stress[1]) == pytest.approx(found.packing.pressure, rel=1e-9)
    assert 1e5 < found.packing.pressure < 3e5
    assert not found.packing.loose


@pytest.mark.parametrize("how", ["relaxed", "inward"])
def test_discs_too_few_to_hold_each_other_are_called_loose(how):
    found = packing_of(SQUARE, soil_discs(packing=how, target="porosity", porosity=0.2))
    assert found.packing.loose
    assert found.packing.pressure < 25.0
    assert found.packing.porosity == pytest.approx(0.2, abs=1e-12)


def test_a_porosity_that_squeezes_the_discs_is_refused():
    with pytest.raises(SceneError, match=r"overlap by .* on average to reach 0.03") as refused:
        packing_of(SQUARE, soil_discs(target="porosity", porosity=0.03))
    about = float(refused.value.problems[0].remedy.rpartition(" ")[2])
    assert 0.15 < about < 0.19  # where discs of these sizes touch without force


def test_denser_packings_carry_more():
    pressures = [packing_of(SQUARE, soil_discs(target="porosity", porosity=n)).packing.pressure for n in (0.16, 0.15, 0.14)]
    assert (np.diff(pressures) > 50e3).all()


@pytest.mark.parametrize("how", ["relaxed", "inward"])
def test_a_wide_grading(how):
    """Diameters from 20 to 200 mm in equal shares of area a decade: denser than equal discs, none outside, none lost."""
    grading = Grading(curve=[[0.02, 0.0], [0.2, 1.0]])
    corners = 1.5 * OBLIQUE
    found = packing_of(corners, soil_discs(grading=grading, radius=grading.mean_radius, packing=how))
    radius = found.packing.radius
    assert found.packing.pressure == pytest.approx(100e3, rel=0.03)
    assert 0.10 < found.packing.porosity < 0.14
    assert shapely.contains_xy(shapely.Polygon(corners), found.packing.xy).all()
    assert radius.max() / radius.min() > 8.0


def test_same_seed_same_bits_other_seed_other_packing():
    (_, one), (_, same), (_, other) = (packed(SQUARE, soil_discs(), seed) for seed in (1, 1, 2))
    assert one.disc.tobytes() == same.disc.tobytes()
    assert one.disc.tobytes() != other.disc.tobytes()


def test_a_window_smaller_than_a_disc_is_refused():
    ring = build_ring(rim(SQUARE), 0.1)
    with pytest.raises(ValueError, match="smaller radius"):
        pack(SQUARE, ring.xy, ring.radius, soil_discs(radius=0.6), np.random.default_rng(0))


def test_points_are_spread_evenly():
    points = spread_points(shapely.Polygon(ANGLE), 3000, np.random.default_rng(0))
    assert shapely.contains_xy(shapely.Polygon(ANGLE), points).all()
    in_corner = (points < 0.75).all(axis=1).sum()
    assert in_corner == pytest.approx(1000, abs=15)


def test_strips_keep_neighbours_together():
    xy = np.random.default_rng(0).random((1000, 2)) * [1.0, 3.0]
    jump = np.hypot(*np.diff(xy[in_strips(xy, 0.1)], axis=0).T)
    assert np.median(jump) < 0.1


def test_progress_is_told_at_least_every_fifty_steps():
    """Large windows take a minute from the first overlaps to rest."""
    model, state = packed(SQUARE, soil_discs())
    shares = []
    run(model, state, 120, shares.append)
    assert shares == [0.0, 50 / 120, 100 / 120]
    told = []
    settle(model, state, lambda text, fraction: told.append((text, fraction)))
    assert [text for text, _ in told] == ["discs spread"] * 8 + ["discs come to rest"] * (1100 // TOLD)
    assert np.all(np.diff([fraction for _, fraction in told]) > 0.0)
