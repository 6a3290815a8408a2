"""Steps towards rest in compiled calls are those of the loop step by step, bit for bit."""

from copy import deepcopy

import numpy as np
import pytest
from window_case import SQUARE, packed_with_stones

from coupler_protocol.files.checkpoint import save
from dem_server.insitu import virtual_strain
from dem_server.packing import growth
from dem_server.step import bonds_made
from dem_server.step.contact_pass import contact_forces
from dem_server.step.motion import move_free
from dem_server.stones import bodies
from tests.same_bits import differing

GRAVITY = 9.81


def one_by_one(model, state, gravity, steps):
    for _ in range(steps):
        move_free(model, state, gravity)
        contact_forces(model, state)


@pytest.fixture(scope="module")
def loose():
    """Model and State of bonded discs and clumps that fly about, so bonds break and lists are built."""
    model, state, found = packed_with_stones(SQUARE)
    model = bodies.form_stones(model, state, found.outlines, "clump")
    bonds_made.add_bonds(model, state)
    kick = 2e-4 * np.random.default_rng(0).standard_normal((model.count - model.ring, 2))
    state.v[model.ring :] += kick
    return model, state


@pytest.mark.parametrize(
    ("compiled", "gravity"),
    [(lambda *of: virtual_strain.relax(*of, GRAVITY, 170), GRAVITY), (lambda *of: growth.run(*of, 170), 0.0)],
    ids=["relax", "run"],
)
def test_many_steps_in_one_call_have_the_bits_of_single_steps(loose, tmp_path, compiled, gravity):
    model, start = loose
    one, other = deepcopy(start), deepcopy(start)
    compiled(model, one)
    one_by_one(model, other, gravity, 170)
    assert one.builds == other.builds >= start.builds + 3
    assert one.broken_tension + one.broken_shear > start.broken_tension + start.broken_shear
    for name, state in (("one", one), ("other", other)):
        save(tmp_path / f"{name}.h5", state)
    assert differing(tmp_path / "one.h5", tmp_path / "other.h5") == []
