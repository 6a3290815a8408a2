"""A table is an effect; no table, no arrays. Pairs of materials combine as the law says."""

from types import SimpleNamespace

import numpy as np
import pytest
from window_case import SQUARE, packed, soil_discs

from dem_server.effects import RING, SOIL, law_from
from dem_server.effects.bond import Bond
from dem_server.effects.friction import Friction
from dem_server.effects.spring import Spring, in_series
from dem_server.pairs import contacts
from dem_server.step.contact_pass import contact_forces
from dem_server.step.motion import move_free

RING_SOIL = RING * 2 + SOIL


def test_absent_effects_have_no_parameters():
    law = law_from(soil_discs(friction=None, bond=False, damping=None))
    assert law.friction is None
    assert law.bond is None
    assert law.damping is None
    assert not law.has_shear


@pytest.mark.parametrize(
    ("friction", "bond", "insitu", "absent"),
    [
        (0.55, False, True, {"bond_state", "bond_reported"}),
        (None, True, True, set()),
        (None, False, True, {"bond_state", "bond_reported", "shear"}),
        (0.55, True, False, {"reference_gap"}),
    ],
)
def test_absent_effects_have_no_arrays(friction, bond, insitu, absent):
    model, state = packed(SQUARE, soil_discs(radius=0.08, friction=friction, bond=bond), insitu=insitu)
    never = {"stone", "clumps", "rolled", "root_mass", "parallel", "walls", "breaks"}
    assert {name for name, value in vars(state).items() if value is None} == absent | never
    move_free(model, state, 9.81)
    contact_forces(model, state)
    assert np.abs(state.force).max() > 0.0


def test_ring_takes_after_the_disc_that_touches_it():
    law = law_from(soil_discs())
    assert law.spring.normal.tolist() == [2.5e7] * 4
    assert law.friction.coefficient.tolist() == [0.55] * 4
    assert law.bond.tension.tolist() == [1.5e3] * 4


def test_ring_table_overrides():
    spring, friction = Spring(normal=1e8, shear=1e7), Friction(coefficient=0.1)
    ring = SimpleNamespace(spring=spring, friction=friction, bond=None)
    law = law_from(soil_discs(), ring)
    assert law.spring.normal[RING_SOIL] == pytest.approx(in_series(1e8, 5e7))
    assert law.friction.coefficient[RING_SOIL] == 0.1
    assert law.bond.tension[RING_SOIL] == law.bond.shear[RING_SOIL] == 0.0
    assert law.bond.tension[SOIL * 2 + SOIL] == 1.5e3


def test_ring_table_without_springs_keeps_the_discs_own():
    ring = SimpleNamespace(spring=None, friction=None, bond=Bond(tension=1e9, shear=1.0))
    law = law_from(soil_discs(), ring)
    assert law.spring.normal[RING_SOIL] == 2.5e7
    assert law.friction.coefficient[RING_SOIL] == 0.0
    assert (law.bond.tension[RING_SOIL], law.bond.shear[RING_SOIL]) == (1.5e3, 1.0)


def test_contact_stiffness_is_taken_as_given():
    assert law_from(soil_discs(stiffness="contact")).spring.normal.tolist() == [5e7] * 4


def test_forces_agree_with_and_without_idle_effects():
    """Bond table, but nothing bonded: bit for bit the forces of friction alone."""
    results = []
    for bond in (True, False):
        model, state = packed(SQUARE, soil_discs(radius=0.06, bond=bond))
        for _ in range(100):
            move_free(model, state, 9.81)
            contact_forces(model, state)
        results.append((state.disc.tobytes(), contacts(state).shear_force.tobytes()))
    assert results[0] == results[1]
