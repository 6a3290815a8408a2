"""Nodal mixed discretisation: an energy, not stiffer than zones, blind to alternate signs, within one material."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from grid_cases import ELASTIC, MOHR_COULOMB, material, window
from stiffness_by_steps import stiffness

from coupler_protocol.compiled import threads
from coupler_protocol.scene.tables.grid import Grid
from fdm_server.effects.damping import Damping
from fdm_server.effects.mohr_coulomb import MohrCoulomb
from fdm_server.ground.removed_zones import cut_window
from fdm_server.mesh.grid import build_grid
from fdm_server.mesh.window_zones import window_zones
from fdm_server.model import build_model, new_state
from fdm_server.observe import fields
from fdm_server.observe.energy_ledger import AVERAGING, Ledger
from fdm_server.step import clock, thread_parts
from fdm_server.step.blocks import from_blocks
from fdm_server.step.gridpoint_pass import update_velocities
from fdm_server.step.present_shape import begin_large_strain
from fdm_server.step.zone_pass import advance

PLAIN = {"mohr_coulomb": None, "tension": None}
DILATANT = MohrCoulomb(friction=30.0, cohesion=5e4, dilation=30.0)
ABOVE = [(2.0, -1.0), (7.0, -1.0), (7.0, 6.0), (4.0, 6.0)]  # an oblique boundary of two materials


def box(*materials, mixed="nodal", shake=0.25, size=(6.0, 5.0), zone=1.0):
    """Model and State of a box of shaken zones, with triangles in one column."""
    grid = Grid(kind="box", length=size[0], height=size[1], zone_size=zone, mixed=mixed)
    scene = SimpleNamespace(grid=grid, material=materials or [material(**PLAIN)], boundary=[], damping=Damping(local=0.0))
    built = build_grid(scene)
    xy = built.xy + shake * zone * np.random.default_rng(7).uniform(-1.0, 1.0, built.xy.shape)
    model = build_model(scene, built._replace(xy=xy))
    return model, new_state(model)


def mean_stress(model, state):
    return from_blocks(state.stress, len(model.zone))[:, 0]


def shaken(model, state, steps=30, size=3e-4, seed=3):
    """Random motion, the same for every model with these gridpoints."""
    rng = np.random.default_rng(seed)
    for _ in range(steps):
        state.velocity[:] = size / clock.seconds(state) * rng.normal(size=state.velocity.shape)
        advance(model, state)
    return state


@pytest.mark.parametrize("large", [False, True])
def test_a_rigid_motion_gives_no_strain(large):
    model, state = box(material(mohr_coulomb=DILATANT, tension=None))
    if large:
        begin_large_strain(model, state)
    angle = 1e-3 if large else 1e-9
    turn = np.array([[np.cos(angle) - 1.0, -np.sin(angle)], [np.sin(angle), np.cos(angle) - 1.0]])
    for _ in range(50):
        xy = model.grid.xy + (state.displacement if large else 0.0)
        state.velocity[:] = xy @ turn.T + (2e-3, -1e-3)
        advance(model, state)
    assert np.abs(state.stress).max() < (1e-10 if large else 1e-16) * ELASTIC.shear


@pytest.mark.parametrize("large", [False, True])
def test_an_even_strain_is_exact_on_an_oblique_mesh(large):
    gradient = np.array([[2e-5, -3e-5], [1e-5, 5e-6]])
    found = []
    for mixed in ("zone", "nodal"):
        model, state = box(mixed=mixed)
        if large:
            begin_large_strain(model, state)
        state.velocity[:] = model.grid.xy @ gradient.T
        advance(model, state)
        found.append(fields.stress(model, state))
    np.testing.assert_allclose(found[1], found[0], rtol=1e-12)
    assert np.ptp(found[1], axis=0).max() < 1e-10 * np.abs(found[1]).max()


@pytest.mark.parametrize("shake", [0.0, 0.3])
def test_the_stiffness_is_symmetric_and_between_rigid_motion_and_that_of_zones(shake):
    """So the forces are those of an energy, and every step that is stable without averages is stable with them."""
    nodal, zone = (stiffness(box(mixed=mixed, shake=shake)[0]) for mixed in ("nodal", "zone"))
    scale = np.abs(zone).max()
    np.testing.assert_allclose(nodal, nodal.T, atol=1e-9 * scale)
    values = np.linalg.eigvalsh(nodal)
    assert values[0] > -1e-9 * scale
    assert (values < 1e-9 * scale).sum() == 3
    assert np.linalg.eigvalsh(zone - nodal)[0] > -1e-9 * scale
    assert np.abs(zone - nodal).max() > 0.05 * scale


def test_volumetric_strains_of_alternate_signs_give_no_mean_stress():
    """u = (-1)^column x-motion of columns of gridpoints makes zones wider and narrower by turns."""
    found = {}
    for mixed in ("zone", "nodal"):
        model, state = box(mixed=mixed, shake=0.0, size=(8.0, 8.0))
        column = np.rint(model.grid.xy[:, 0]).astype(int)
        state.velocity[:, 0] = 1e-5 * np.where(column % 2 == 0, 1.0, -1.0)
        advance(model, state)
        inside = (np.abs(model.grid.xy[model.zones].mean(axis=1) - 4.0) < 3.0).all(axis=1)
        found[mixed] = np.abs(mean_stress(model, state)[inside])
    assert found["zone"].min() > 1e-6 * ELASTIC.bulk
    assert found["nodal"].max() < 1e-12 * ELASTIC.bulk


def test_nothing_is_averaged_over_the_boundary_of_materials_or_a_removed_zone():
    """Motion of the gridpoints of one material alone leaves the mean stress of the other as it is without averages."""
    alone, other = material("a", **PLAIN), material("b", region=ABOVE, **PLAIN)
    found = {}
    for mixed in ("zone", "nodal"):
        model, state = box(alone, other, mixed=mixed)
        kinds = model.grid.material[model.zone]
        assert 3 < kinds.sum() < len(kinds) - 3
        inner = np.setdiff1d(model.zones[kinds == 1], model.zones[kinds == 0])
        state.velocity[inner] = 1e-4 * np.random.default_rng(1).normal(size=(len(inner), 2))
        advance(model, state)
        found[mixed] = mean_stress(model, state)
    assert np.abs(found["nodal"][kinds == 0]).max() == 0.0
    assert np.abs(found["nodal"][kinds == 1]).max() > 0.0
    model, state = box(shake=0.0, size=(7.0, 3.0))
    cut, *_ = cut_window(model, state, window_zones(model.grid, window((3, 3), (1, 1))))
    assert len(cut.nodal.zone) == 4 * len(cut.zone) < len(model.nodal.zone)
    joints = from_blocks(cut.nodal.joint, len(cut.zone))
    assert len(np.unique(joints)) == len(np.unique(cut.zones))  # the rest is one body: one joint at a gridpoint


@pytest.mark.parametrize("law", [None, MOHR_COULOMB, DILATANT])
def test_the_energy_ledger_closes_and_averaging_is_named(law):
    model, state = box(material(mohr_coulomb=law, tension=None))
    books = Ledger(model, state)
    state.velocity[:] = 2e-5 * np.random.default_rng(5).normal(size=state.velocity.shape)
    state.velocity[:, 0] += 4e-4 * model.grid.xy[:, 1]
    for _ in range(60):
        books.copy_before_step(state)
        update_velocities(model, state, 9.81)
        books.book_motion(model, state, 9.81)
        found = books.values(model, state)
        advance(model, state)
        books.book_strain(model, state)
    scale = found["kinetic"] + found["strain"]
    assert abs(found["error"]) < 1e-11 * scale
    assert abs(found["averaging"]) > 1e-6 * scale
    assert (found["plastic"] > 1e-6 * scale) == (law is not None)
    model, state = box(mixed="zone")
    assert "averaging" not in Ledger(model, state).values(model, state)


def test_elastic_ground_gives_the_work_of_averaging_back():
    model, state = box()
    books = Ledger(model, state)
    way = 1e-4 * np.random.default_rng(9).normal(size=state.velocity.shape)
    taken = []
    for sign in (1.0, -1.0, -1.0, 1.0):
        books.copy_before_step(state)
        state.velocity[:] = sign * way
        advance(model, state)
        books.book_strain(model, state)
        taken.append(float(books.book.sums[AVERAGING]))
    assert taken[0] > 0.0
    assert taken[0] == pytest.approx(taken[2], rel=1e-9)
    assert abs(taken[1]) < 1e-9 * taken[0]
    assert abs(taken[3]) < 1e-9 * taken[0]


def test_changes_by_flow_are_averaged_and_the_forces_follow():
    """Forces are those of the stresses left: a step without motion does not change them. Means over the area stay."""
    model, state = box(material(mohr_coulomb=DILATANT, tension=None), shake=0.2)
    shaken(model, state, size=1e-3)
    assert (fields.plastic_state(model, state) > 0).mean() > 0.5
    force = state.force.copy()
    state.velocity[:] = 0.0
    elastic = replace(model, law=model.law._replace(mohr_coulomb=None))
    state.plastic = None
    advance(elastic, state)
    np.testing.assert_allclose(state.force, force, atol=1e-9 * np.abs(force).max())


@pytest.mark.parametrize("large", [False, True])
def test_threads_have_the_same_bits(monkeypatch, large):
    monkeypatch.setattr(thread_parts, "FEWEST", 1)
    found = []
    before = threads.size()
    for count in (1, 2):
        threads.set_size(count)
        try:
            model, state = box(material(mohr_coulomb=DILATANT), size=(64.0, 48.0))
        finally:
            threads.set_size(before)
        assert len(model.partition.strips) == count
        if large:
            begin_large_strain(model, state)
        found.append(shaken(model, state, steps=3))
    for name in ("stress", "force", "displacement"):
        assert getattr(found[0], name).tobytes() == getattr(found[1], name).tobytes()
    assert found[0].plastic.any()


def test_a_joint_has_the_mean_over_the_area():
    """One step of one zone's own volume: what it loses its neighbours get."""
    model, state = box(shake=0.3)
    zone = mean_stress(*_after_random(box(mixed="zone", shake=0.3)))
    nodal = mean_stress(*_after_random((model, state)))
    area = 0.5 / from_blocks(model.geometry.inverse_double_area, len(model.zone))[:, 4]
    assert area @ nodal == pytest.approx(area @ zone, rel=1e-10, abs=1e-10 * np.abs(area * zone).sum())
    assert np.std(nodal) < 0.7 * np.std(zone)


def _after_random(pair):
    model, state = pair
    shaken(model, state, steps=1)
    return model, state
