"""Stones on a packing: who belongs to them, what they weigh, and that making them changes no force."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
from window_case import OBLIQUE, SQUARE, packed_with_stones, stone_grain

from coupler_protocol.geometry import moments, polygon_area
from dem_server.effects import SOIL, STONE
from dem_server.effects.bond import BONDED
from dem_server.effects.spring import SpringTable
from dem_server.insitu import virtual_strain
from dem_server.insitu.contact_stress import mean_stress
from dem_server.insitu.hat_bins import bins_over
from dem_server.observe import energy
from dem_server.observe.unbalanced_ratio import unbalanced_ratio
from dem_server.pairs import contacts, listed_pairs
from dem_server.step import bonds_made
from dem_server.stones import bodies

TALL = 1.5 * SQUARE
GRAVITY = 9.81


def level_ground(corners):
    """Zones (z, 7) of 2700 kg/m3 under a level surface at y = 5 m."""
    points = bins_over(corners, 0.125).points
    syy = -2700.0 * GRAVITY * (5.0 - points[:, 1])
    area = np.full(len(points), polygon_area(corners) / len(points))
    return np.column_stack([points, area, 0.571 * syy, syy, 0.0 * syy, np.full(len(points), 2700.0)])


def brought(seed=0):
    model, state, found = packed_with_stones(TALL, seed)
    target = level_ground(TALL)
    factor = virtual_strain.match_weight(model, state, target)
    virtual_strain.bring_to_stress(model, state, target, GRAVITY)
    return model, state, found, target, factor


def test_discs_belong_to_the_stone_their_centre_lies_in():
    model, state, found = packed_with_stones(TALL)
    for k, outline in enumerate(found.outlines):
        inside = shapely.contains_xy(shapely.Polygon(outline), state.x)
        assert (inside == (state.stone == k)).all()
    assert (state.stone[: model.ring] == -1).all()
    report = bodies.report(model, state, found, TALL)
    assert report["stones"] == len(found.outlines)
    assert report["stone_content"] == pytest.approx(0.45, rel=1e-12)
    inner = shapely.Polygon(TALL).buffer(-state.radius[: model.ring].max()).area  # where free discs are
    assert report["stone_content_discs"] == pytest.approx(0.45 * polygon_area(TALL) / inner, abs=0.03)


def test_gaps_inside_stones_are_reported():
    """Of the window: polygons without the discs that belong to them, and without what discs of the soil cut off."""
    model, state, found = packed_with_stones(TALL)
    discs = shapely.buffer(shapely.points(state.x), state.radius, quad_segs=64)
    gaps = -np.pi * (state.radius[state.stone >= 0] ** 2).sum()
    for k, outline in enumerate(found.outlines):
        if (state.stone == k).any():
            stone = shapely.Polygon(outline)
            gaps += stone.area - shapely.area(shapely.intersection(stone, discs[state.stone < 0])).sum()
    report = bodies.report(model, state, found, TALL)
    assert report["stone_gaps"] == pytest.approx(gaps / polygon_area(TALL), abs=2e-5)
    assert 0.02 < report["stone_gaps"] < 0.1


def test_a_stone_weighs_its_polygon_and_the_soil_the_rest():
    model, state, found = packed_with_stones(TALL)
    target = level_ground(TALL)
    virtual_strain.match_weight(model, state, target)
    held = np.bincount(state.stone[state.stone >= 0], state.weight[state.stone >= 0], len(found.outlines))
    expected = [2700.0 * polygon_area(outline) for outline in found.outlines]
    np.testing.assert_allclose(held[held > 0], np.array(expected)[held > 0], rtol=1e-12)
    assert state.weight.sum() == pytest.approx(2700.0 * polygon_area(TALL), rel=1e-12)


def test_a_stone_weighs_at_its_centroid():
    """Also before it is a clump, so that it does not turn when it becomes one; discs too few for that come near it."""
    _, state, found = packed_with_stones(TALL)
    before, after = [], []
    for k, outline in enumerate(found.outlines):
        own = state.stone == k
        assert (state.weight[own] > 0.0).all()
        if own.sum() > 5:
            centroid, area = moments(outline).centroid, state.radius[own] ** 2
            after.append(np.hypot(*(state.weight[own] @ state.x[own] / state.weight[own].sum() - centroid)))
            before.append(np.hypot(*(area @ state.x[own] / area.sum() - centroid)))
    assert len(after) > 5
    assert max(after) < 1e-12
    assert max(before) > 1e-3  # by area alone


def test_stones_heavier_than_the_zones_are_refused():
    model, state, _ = packed_with_stones(TALL)
    target = level_ground(TALL)
    target[:, 6] = 1000.0
    with pytest.raises(ValueError, match="weigh more than the zones"):
        virtual_strain.match_weight(model, state, target)


@pytest.mark.parametrize("body", ["clump", "cluster"])
def test_making_stones_changes_no_force(body):
    """Stones ten times as stiff: forces on the ring stay to round-off, and the discs stay at rest."""
    model, state, found, _, _ = brought()
    before = state.force[: model.ring].copy()
    stress = mean_stress(contacts(state), polygon_area(TALL))
    model = bodies.form_stones(model, state, found.outlines, body)
    scale = np.abs(before).max()
    np.testing.assert_allclose(state.force[: model.ring], before, atol=1e-10 * scale)
    assert (model.material[model.ring :] == np.where(state.stone[model.ring :] >= 0, STONE, SOIL)).all()
    assert unbalanced_ratio(model, state, GRAVITY) < 1e-5
    bonds_made.add_bonds(model, state)
    virtual_strain.relax(model, state, GRAVITY, 300)
    virtual_strain.come_to_rest(model, state, GRAVITY)
    assert state.broken_tension + state.broken_shear == 0
    assert unbalanced_ratio(model, state, GRAVITY) < 1e-6
    np.testing.assert_allclose(mean_stress(contacts(state), polygon_area(TALL)), stress, atol=1e-3 * np.abs(stress).max())


@pytest.mark.parametrize("body", ["clump", "cluster"])
@pytest.mark.parametrize("ratio", [10.0, 1e3, 1e4])
def test_stones_become_stiffer_under_stress_without_a_jump(ratio, body):
    """Any ratio: no contact force changes by more than round-off, nothing moves, and the stress stays."""
    model, state, found = packed_with_stones(OBLIQUE)
    virtual_strain.match_weight(model, state, level_ground(OBLIQUE))
    virtual_strain.bring_to_stress(model, state, level_ground(OBLIQUE), GRAVITY)
    before = contacts(state)
    stress = mean_stress(before, polygon_area(OBLIQUE))
    spring, soil = model.law.spring, SOIL * 3 + SOIL
    stony = (np.arange(9) // 3 == STONE) | (np.arange(9) % 3 == STONE)  # contacts inside stones, between them, with soil and ring
    stiffer = SpringTable(*(np.where(stony, ratio * column[soil], column) for column in spring))
    model = bodies.form_stones(replace(model, law=model.law._replace(spring=stiffer)), state, found.outlines, body)
    after, scale = contacts(state), before.normal_force.max()
    touched = (state.stone[after.disc_a] >= 0) | (state.stone[after.disc_b] >= 0)
    np.testing.assert_allclose(stiffer.normal[after.kind], np.where(touched, ratio, 1.0) * spring.normal[soil])
    pairs = [dict(zip(zip(p.disc_a.tolist(), p.disc_b.tolist(), strict=True), p.force, strict=True)) for p in (before, after)]
    changes = [np.abs(force - pairs[0].get(pair, 0.0)).max() for pair, force in pairs[1].items()]
    assert max(changes) <= 1e-9 * scale
    assert (len(pairs[1]) < len(pairs[0])) == (body == "clump")  # a clump has no contacts inside
    stored, fastest = energy.stored(model, state), 0.0
    for _ in range(300):
        virtual_strain.relax(model, state, GRAVITY, 1)
        fastest = max(fastest, energy.kinetic(model, state))
    assert fastest <= 1e-9 * stored
    assert unbalanced_ratio(model, state, GRAVITY) <= 1e-5
    change = np.abs(mean_stress(contacts(state), polygon_area(OBLIQUE)) - stress).max()
    assert change <= 1e-4 * np.abs(stress).max()


def test_stiffening_without_the_reference_gap_would_be_a_blow():
    """What equation (1) avoids: the same stiffness with the old gaps multiplies the stress."""
    model, state, *_ = brought()
    stress = mean_stress(contacts(state), polygon_area(TALL))
    gaps = state.reference_gap.copy()
    bodies.stiffen_stones(model, state)
    pairs = contacts(state)
    assert np.abs(state.reference_gap - gaps).max() > 0.0
    force = model.law.spring.normal[state.kind[pairs.slot]] * (gaps - state.reference_gap)[pairs.slot]
    jump = mean_stress(pairs._replace(normal_force=pairs.normal_force + force), polygon_area(TALL))
    assert jump[1] < 2.0 * stress[1]


def test_clusters_are_bonded_whole():
    model, state, found = packed_with_stones(TALL)
    model = bodies.form_stones(model, state, found.outlines, "cluster")
    pairs = listed_pairs(state)
    own = (state.stone[pairs.disc_a] >= 0) & (state.stone[pairs.disc_a] == state.stone[pairs.disc_b])
    assert (pairs.bond_state[own] == BONDED).all()
    assert not (pairs.bond_state[~own] == BONDED).any()
    assert set(model.law.bond.tension[pairs.kind[own]]) == {stone_grain().bond.tension}
    assert state.clumps is None


@pytest.mark.parametrize("body", ["clump", "cluster"])
def test_with_stones_the_stress_is_still_that_of_the_zones(body):
    model, state, found = packed_with_stones(TALL)
    target = level_ground(TALL)
    virtual_strain.match_weight(model, state, target)
    aim = virtual_strain.aim_of(model, state, target)
    before = virtual_strain.bring_to_stress(model, state, target, GRAVITY)
    assert virtual_strain.stress_error(state, aim).tolist() == [before.error_xx, before.error_yy, before.error_xy]
    model = bodies.form_stones(model, state, found.outlines, body)
    virtual_strain.come_to_rest(model, state, GRAVITY)
    assert max(virtual_strain.stress_error(state, aim, found.outlines)) < 0.05
