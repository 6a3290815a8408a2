"""The same questions to every effect of the continuum: a field of `Law` without a case here fails the first test."""

import copy
import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from grid_cases import ELASTIC, MOHR_COULOMB, material, window

from coupler_protocol.files import checkpoint
from coupler_protocol.scene.tables.grid import Grid
from fdm_server.effects import Law
from fdm_server.effects.damping import Damping
from fdm_server.effects.rayleigh import RayleighTable
from fdm_server.effects.softening import Softening
from fdm_server.effects.tension import Tension
from fdm_server.ground.removed_zones import cut_window
from fdm_server.mesh.grid import build_grid
from fdm_server.mesh.window_zones import window_zones
from fdm_server.model import State, build_model, new_state, places
from fdm_server.observe.energy import strain_energy
from fdm_server.step import clock
from fdm_server.step.blocks import from_blocks
from fdm_server.step.gridpoint_pass import kinetic_energy, update_velocities
from fdm_server.step.histories import ZONE
from fdm_server.step.zone_pass import advance

SOFT = Softening(strain=[1e-4, 1e-3], cohesion=[2e4, 1e4])
LIMITS = {"mohr_coulomb": MOHR_COULOMB, "tension": Tension(strength=1e4), "softening": SOFT}
NEEDS = {"softening": ("mohr_coulomb",)}
DAMPING = {
    "damping": Damping(local=0.8),
    "combined": Damping(combined=0.8),
    "rayleigh": Damping(rayleigh=RayleighTable(fraction=0.1, frequency=50.0)),
}
ELSEWHERE = {"added"}  # test_added_laws.py: needs another distribution
EFFECTS = ("elastic", *LIMITS, *DAMPING)


def box(name):
    """Model and state of 4 x 3 zones under one effect (and what it needs)."""
    tables = {key: LIMITS[key] if key == name or key in NEEDS.get(name, ()) else None for key in LIMITS}
    grid = Grid(kind="box", length=4.0, height=3.0, zone_size=1.0)
    undamped = Damping(local=0.0)
    scene = SimpleNamespace(grid=grid, material=[material(elastic=ELASTIC, **tables)], boundary=[], damping=undamped)
    model = build_model(scene, build_grid(scene))
    state = new_state(model)
    model = clock.begin(model, state, DAMPING.get(name, undamped), 0.5 if name == "rayleigh" else None)
    return model, state


def strained(model, state, gradient, steps=50):
    """Strain all zones evenly by a displacement gradient (2,2)."""
    state.velocity[:] = model.grid.xy @ np.asarray(gradient).T / (steps * clock.seconds(state))
    for _ in range(steps):
        advance(model, state)
    state.velocity[:] = 0.0


def test_every_effect_is_asked():
    assert set(EFFECTS) | ELSEWHERE == set(Law._fields)


def test_every_field_of_state_says_where_it_lives():
    assert set(places()) == {field.name for field in dataclasses.fields(State)}
    assert set(places().values()) <= {"zone", "gridpoint", "neither"}


@pytest.mark.parametrize("name", EFFECTS)
def test_an_absent_table_leaves_no_parameters_and_no_arrays(name):
    model, state = box("elastic")
    assert name == "elastic" or getattr(model.law, name) is None
    mine = box(name)[0].law.histories
    for history in mine:
        assert getattr(state, history) is None
    assert all(getattr(box(name)[1], history) is not None for history in mine)


@pytest.mark.parametrize("name", EFFECTS)
def test_zero_strain_changes_no_stress(name):
    model, state = box(name)
    strained(model, state, [[-2e-4, 1e-4], [0.0, -3e-4]])
    before = state.stress.copy()
    advance(model, state)
    assert np.array_equal(state.stress, before)


@pytest.mark.parametrize("name", ["elastic", *LIMITS])
def test_a_closed_cycle_of_strain_gives_no_energy(name):
    """Work of the zones' forces on the way there and back is what they dissipate: none if elastic, never negative."""
    model, state = box(name)
    start, work = strain_energy(model, state), 0.0
    for way in ([[2e-4, 8e-4], [0.0, 1e-4]], [[-2e-4, -8e-4], [0.0, -1e-4]]):
        for _ in range(50):
            force = state.force.copy()
            before = state.displacement.copy()
            strained(model, state, np.array(way) / 50, steps=1)
            work -= 0.5 * np.sum((force + state.force) * (state.displacement - before))
    there = box("elastic")
    strained(*there, way)
    scale = strain_energy(*there)
    dissipated = work - (strain_energy(model, state) - start)
    assert np.abs(state.displacement).max() < 1e-12
    assert dissipated > -1e-9 * scale
    assert (dissipated > 1e-3 * scale) == (name != "elastic")


@pytest.mark.parametrize("name", DAMPING)
def test_damping_only_takes_energy(name):
    """A box let go from an even strain: energy at rest falls below what it was, more than without damping."""
    left = {}
    for kind in ("elastic", name):
        model, state = box(kind)
        strained(model, state, [[1e-4, 0.0], [0.0, 1e-4]])
        start = strain_energy(model, state)
        for _ in range(200):
            update_velocities(model, state, 0.0)
            advance(model, state)
        left[kind] = (strain_energy(model, state) + kinetic_energy(model, state)) / start
    assert 0.0 <= left[name] < 0.9
    assert left[name] < left["elastic"] < 1.5


@pytest.mark.parametrize("name", EFFECTS)
def test_a_checkpoint_brings_back_every_bit(name, tmp_path):
    model, state = box(name)
    strained(model, state, [[1e-4, 8e-4], [0.0, 2e-4]])
    checkpoint.save(tmp_path / "state.h5", state)
    back = checkpoint.rebuild(State, checkpoint.load(tmp_path / "state.h5")[0])
    for one in (state, back):
        one.velocity[:, 0] = 1e-5 * model.grid.xy[:, 1] / clock.seconds(one)
        for _ in range(3):
            update_velocities(model, one, 9.81)
            advance(model, one)
    for field in places():
        assert np.array_equal(getattr(state, field), getattr(back, field)), field


@pytest.mark.parametrize("name", EFFECTS)
def test_what_zones_remember_survives_the_cut_of_a_window(name):
    model, state = box(name)
    rng = np.random.default_rng(1)
    state.memory["of_another_law"] = np.zeros((len(state.stress), 16))
    arrays = {field: getattr(state, field) for field, place in places().items() if place == ZONE and field != "memory"}
    arrays = {field: array for field, array in arrays.items() if array is not None} | state.memory
    for array in arrays.values():
        array[:] = rng.integers(1, 9, array.shape)
    mask = window_zones(model.grid, window((1, 2), (1, 1)))
    before = copy.deepcopy(arrays)
    cut, after, _ = cut_window(model, state, mask)
    for field, array in before.items():
        assert np.array_equal(from_blocks(after.history(field), len(cut.zone)), from_blocks(array, len(mask))[~mask]), field
