"""The same questions to every effect of the continuum: a field of `Law` without a case here fails the first test.

Laws of other distributions are asked where they are installed: a test here installs two and runs this file there. Run as a module
it writes what all cases come to, for the comparison of compiled and interpreted kernels:

    python -m tests.fdm_server.effects.test_every_effect FILE
"""

import copy
import dataclasses
import os
import re
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from coupler_protocol.files import checkpoint
from coupler_protocol.scene.tables.grid import Grid
from fdm_server.effects import Law, added_laws
from fdm_server.effects.damping import Damping
from fdm_server.effects.rayleigh import RayleighTable
from fdm_server.effects.softening import Softening
from fdm_server.effects.tension import Tension
from fdm_server.ground.removed_zones import cut_window
from fdm_server.mesh.grid import build_grid
from fdm_server.mesh.window_zones import window_zones
from fdm_server.model import State, build_model, new_state, places
from fdm_server.observe.energy import strain_energy
from fdm_server.observe.energy_ledger import Ledger
from fdm_server.step import clock
from fdm_server.step.blocks import from_blocks
from fdm_server.step.gridpoint_pass import kinetic_energy, update_velocities
from fdm_server.step.histories import ZONE
from fdm_server.step.zone_pass import advance
from tests.commands import ROOT, command, finished
from tests.fdm_server.effects.installed_laws import install, python
from tests.fdm_server.grid_cases import ELASTIC, MOHR_COULOMB, material, window

SOFT = Softening(strain=[1e-4, 1e-3], cohesion=[2e4, 1e4])
LIMITS = {"mohr_coulomb": MOHR_COULOMB, "tension": Tension(strength=1e4), "softening": SOFT}
NEEDS = {"softening": ("mohr_coulomb",)}
DAMPING = {
    "damping": Damping(local=0.8),
    "combined": Damping(combined=0.8),
    "rayleigh": Damping(rayleigh=RayleighTable(fraction=0.1, frequency=50.0)),
}
ADDED = {"hardening_mises": {"strength": 5e4, "hardening": 5e7}, "crushing": {"pressure": 1e5}}  # laws of the folder `laws`
INSTALLED = {name: law(**ADDED[name]) for name, law in added_laws.declared().items() if name in ADDED}
LAWS = ("elastic", *LIMITS, *INSTALLED)
EFFECTS = (*LAWS, *DAMPING, "nodal")
EVERY = pytest.mark.parametrize("name", EFFECTS)


def box(name):
    """Model and state of 4 x 3 zones under one effect (and what it needs)."""
    tables = {key: LIMITS[key] if key == name or key in NEEDS.get(name, ()) else None for key in LIMITS}
    soil = material(elastic=ELASTIC, **tables)
    if name in INSTALLED:
        setattr(soil, name, INSTALLED[name])
    grid = Grid(kind="box", length=4.0, height=3.0, zone_size=1.0, mixed="nodal" if name == "nodal" else "zone")
    undamped = Damping(local=0.0)
    scene = SimpleNamespace(grid=grid, material=[soil], boundary=[], damping=undamped)
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


def arrays_of(state):
    """All arrays of a State, those that added laws remember too: {name: array}."""
    fields = {name: getattr(state, name) for name in places() if name != "memory"}
    return {name: value for name, value in (fields | state.memory).items() if isinstance(value, np.ndarray)}


def test_every_effect_is_asked():
    """A field of Law is one effect; those of other distributions share the field `added`."""
    assert set(EFFECTS) - set(INSTALLED) | {"added"} == set(Law._fields)


@pytest.mark.long
@pytest.mark.skipif(bool(INSTALLED), reason="the laws are installed, and asked")
def test_laws_of_another_distribution_are_asked_the_same(tmp_path):
    folder = install(tmp_path)
    words = ["-m", "pytest", "-q", "-rA", "-n", "0", "-p", "no:cacheprovider", "-k", " or ".join(["elastic", *ADDED]), __file__]
    done = python(words, folder)
    assert done.returncode == 0, done.stdout + done.stderr
    asked = {name: set(re.findall(rf"^PASSED .*::(\w+)\[{name}\]$", done.stdout, re.MULTILINE)) for name in ("elastic", *ADDED)}
    assert len(asked["elastic"]) == 7
    assert asked == {name: asked["elastic"] for name in asked}


def test_every_field_of_state_says_where_it_lives():
    assert set(places()) == {field.name for field in dataclasses.fields(State)}
    assert set(places().values()) <= {"zone", "gridpoint", "neither"}


@EVERY
def test_an_absent_table_leaves_no_parameters_and_no_arrays(name):
    model, state = box("elastic")
    assert name == "elastic" or getattr(model.law, "added" if name in INSTALLED else name) is None
    its_model, its_state = box(name)
    assert not set(its_model.law.histories) & set(arrays_of(state))
    assert set(its_model.law.histories) <= set(arrays_of(its_state))


@EVERY
def test_zero_strain_changes_no_stress(name):
    model, state = box(name)
    strained(model, state, [[-2e-4, 1e-4], [0.0, -3e-4]])
    before = state.stress.copy()
    advance(model, state)
    assert np.array_equal(state.stress, before)


@pytest.mark.parametrize("name", LAWS)
def test_a_closed_cycle_of_strain_gives_no_energy(name):
    """Work of the zones' forces on a way to both sides and back is what they dissipate: none if elastic, never negative."""
    model, state = box(name)
    start, work = strain_energy(model, state), 0.0
    out, back = [[2e-4, 8e-4], [0.0, 1e-4]], [[-2e-4, -8e-4], [0.0, -1e-4]]
    for way in (out, back, back, out):
        for _ in range(50):
            force = state.force.copy()
            before = state.displacement.copy()
            strained(model, state, np.array(way) / 50, steps=1)
            work -= 0.5 * np.sum((force + state.force) * (state.displacement - before))
    there = box("elastic")
    strained(*there, out)
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


@EVERY
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
    found, again = arrays_of(state), arrays_of(back)
    assert {name: array.tobytes() for name, array in again.items()} == {name: array.tobytes() for name, array in found.items()}
    assert (back.dt, back.mass_age) == (state.dt, state.mass_age)


@EVERY
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


def moved(name, ledger=False):
    """State and, if asked for, energies of a box that is stretched, sheared, pressed together and let go under its weight."""
    model, state = box(name)
    strained(model, state, [[2e-4, 8e-4], [0.0, 2e-4]], steps=20)
    strained(model, state, [[-6e-4, 0.0], [0.0, -6e-4]], steps=20)
    books, found = Ledger(model, state) if ledger else None, None
    for _ in range(20):
        if books:
            books.copy_before_step(state)
        update_velocities(model, state, 9.81)
        if books:
            books.book_motion(model, state, 9.81)
            found = books.values(model, state)
        advance(model, state)
        if books:
            books.book_strain(model, state)
    return state, found


@EVERY
def test_the_energy_ledger_closes(name):
    """To round-off (small strain), and only what the effect can take is lost."""
    _, found = moved(name, ledger=True)
    scale = found["kinetic"] + found["strain"]
    assert abs(found["error"]) < 1e-12 * scale
    for loss, losers in (("plastic", {*LIMITS, *INSTALLED}), ("damping", set(DAMPING))):
        assert found[loss] > -1e-12 * scale
        assert (found[loss] > 1e-6 * scale) == (name in losers), loss


def write_all(path):
    """What the arrays of every case come to."""
    found = {name: arrays_of(moved(name)[0]) for name in EFFECTS}
    np.savez(path, **{f"{name}/{field}": array for name, arrays in found.items() for field, array in arrays.items()})


@pytest.fixture(scope="module")
def interpreted(tmp_path_factory):
    """Arrays of all cases without the compiler, computed in one process: {"effect/field": array}."""
    path = tmp_path_factory.mktemp("interpreted") / "cases.npz"
    folders = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])  # the installed laws, where they are
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": folders, "PYTHONWARNINGS": "ignore"}
    done = finished(command("tests.fdm_server.effects.test_every_effect", path), env=environment)
    assert done.returncode == 0, done.stderr
    return dict(np.load(path))


@EVERY
def test_compiled_is_interpreted(name, interpreted):
    plain = {field.partition("/")[2]: array for field, array in interpreted.items() if field.startswith(f"{name}/")}
    compiled = arrays_of(moved(name)[0])
    assert compiled.keys() == plain.keys()
    for field, array in compiled.items():
        np.testing.assert_allclose(array, plain[field], rtol=1e-12, atol=1e-12 * np.abs(array).max(initial=0.0), err_msg=field)
    assert name == "elastic" or not np.allclose(compiled["stress"], interpreted["elastic/stress"], rtol=1e-6)


if __name__ == "__main__":
    write_all(sys.argv[1])
