"""What a law remembers is declared beside the law, once; State, stages and removed zones go by the declaration."""

import dataclasses
import importlib
import pkgutil
from types import SimpleNamespace

import numpy as np
import pytest

from coupler_protocol.files import checkpoint
from coupler_protocol.scene.declare import History
from fdm_server import effects
from fdm_server.effects import Law, histories
from fdm_server.effects.damping import Damping
from fdm_server.effects.softening import Softening
from fdm_server.mesh.grid import build_grid
from fdm_server.model import State, build_model, new_state, places
from fdm_server.step import clock
from fdm_server.step.histories import reset_histories
from tests.fdm_server.grid_cases import MOHR_COULOMB, material, slope

PLANTED = SimpleNamespace(
    HISTORIES=(History("heat", "zone", unit="J"), History("visits", "gridpoint", dtype="i8", components=2, of_stage=True))
)


def test_a_declaration_is_a_field_with_its_place_and_nothing_else_is_needed():
    cls = histories.fields_of(histories.declared(histories.EFFECTS | {"planted": PLANTED}))
    assert [field.name for field in dataclasses.fields(cls)] == ["plastic", "plastic_shear", "previous_force", "heat", "visits"]
    places_of = {field.name: field.type.__metadata__[0] for field in dataclasses.fields(cls)}
    assert (places_of["heat"], places_of["visits"]) == ("zone", "gridpoint")
    assert cls().heat is None


def test_every_declared_history_is_a_field_of_state_and_belongs_to_a_field_of_law():
    assert set(histories.EFFECTS) <= set(Law._fields)
    names = [f"fdm_server.effects.{module.name}" for module in pkgutil.iter_modules(effects.__path__)]
    declaring = {name for name in names if hasattr(importlib.import_module(name), "HISTORIES")}
    assert declaring == {module.__name__ for module in histories.EFFECTS.values()}  # no declaration is forgotten
    for name, history in histories.DECLARED.items():
        assert places()[name] == history.place
    assert {name for name, history in histories.DECLARED.items() if history.of_stage} == {"previous_force"}


def softening_slope(damping):
    """Model and State of a slope whose material softens, with a damping table."""
    law = {"mohr_coulomb": MOHR_COULOMB, "softening": Softening(strain=[0.01], cohesion=[0.0])}
    scene = slope(zone_size=1.0, materials=[material(**law)])
    scene.damping = damping
    model = build_model(scene, build_grid(scene))
    return model, new_state(model)


@pytest.mark.parametrize("after", [Damping(combined=0.5), Damping(local=0.5)], ids=["combined", "local"])
def test_a_stage_begins_what_its_damping_remembers_and_leaves_what_zones_remember(after):
    model, state = softening_slope(Damping(combined=0.8))
    state.previous_force[:], state.plastic_shear[:], state.plastic[:] = 1.0, 0.5, 4
    model = clock.begin(model, state, after)
    assert (state.previous_force is None) == (after.combined is None)
    assert state.previous_force is None or not state.previous_force.any()
    assert np.all(state.plastic_shear == 0.5)
    assert np.all(state.plastic == 4)
    reset_histories(model, state)
    assert not state.plastic_shear.any()
    assert not state.plastic.any()


def test_the_names_in_a_checkpoint_are_those_of_before(tmp_path):
    _, state = softening_slope(Damping(combined=0.8))
    checkpoint.save(tmp_path / "state.h5", state)
    found = checkpoint.load(tmp_path / "state.h5")[0]
    assert set(found) == {
        "velocity", "displacement", "force", "applied", "added_mass", "stress", "corner_force", "plastic", "mass", "mass_age",
        "driven", "plastic_shear", "previous_force", "dt",
    }  # fmt: skip
    back = checkpoint.rebuild(State, found)
    assert (back.memory, back.loads) == ({}, {})
    assert back.plastic_shear.dtype == np.float64
    assert back.plastic.dtype == np.int64
