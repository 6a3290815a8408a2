"""What a factor does to the strength of materials."""

from math import radians, tan

import pytest

from coupler_protocol.scene.scene import scene_class
from coupler_protocol.scene.tables.fos import FactorOfSafety
from fdm_server.effects.softening import Softening
from fdm_server.fos.reduction import reduced

MATERIAL = scene_class().model_fields["material"].annotation.__args__[0]


def soil(**law):
    """A soil with phi = 30, c = 10 kPa, tension 2 kPa."""
    strong = {"friction": 30.0, "cohesion": 10e3} | law
    return MATERIAL(name="a", density=1.0, elastic={"bulk": 1.0, "shear": 1.0}, mohr_coulomb=strong, tension={"strength": 2e3})


def test_cohesion_and_the_tangent_of_friction_are_divided():
    (found,) = reduced([soil()], 1.7, FactorOfSafety())
    assert found.mohr_coulomb.cohesion == pytest.approx(10e3 / 1.7)
    assert tan(radians(found.mohr_coulomb.friction)) == pytest.approx(tan(radians(30.0)) / 1.7)
    assert found.mohr_coulomb.apex() == pytest.approx(soil().mohr_coulomb.apex())
    assert found.elastic == soil().elastic


@pytest.mark.parametrize(("rule", "psi", "factor", "tangent"), [
    ("kept", 10.0, 1.5, tan(radians(10.0))),  # below the reduced friction: stays
    ("kept", 30.0, 1.5, tan(radians(30.0)) / 1.5),  # associated stays associated
    ("kept", 20.0, 4.0, tan(radians(30.0)) / 4.0),  # friction has come down to it
    ("reduced", 10.0, 1.5, tan(radians(10.0)) / 1.5),
])  # fmt: skip
def test_rules_for_dilation(rule, psi, factor, tangent):
    (found,) = reduced([soil(dilation=psi)], factor, FactorOfSafety(dilation=rule))
    assert tan(radians(found.mohr_coulomb.dilation)) == pytest.approx(tangent)
    assert found.mohr_coulomb.dilation <= found.mohr_coulomb.friction


@pytest.mark.parametrize(("rule", "strength"), [("kept", 2e3), ("reduced", 1e3)])
def test_rules_for_tension(rule, strength):
    (found,) = reduced([soil()], 2.0, FactorOfSafety(tension=rule))
    assert found.tension.strength == strength


def test_soils_without_a_strength_stay():
    rock = soil().model_copy(update={"mohr_coulomb": None, "tension": None})
    assert reduced([rock], 2.0, FactorOfSafety()) == [rock]


def test_softening_curves_are_divided_point_by_point():
    """What is left after softening is divided like what was there before; psi stays below the phi of its own point."""
    curves = {"strain": [0.01, 0.1], "cohesion": [5e3, 0.0], "friction": [25.0, 20.0], "dilation": [20.0, 15.0]}
    soft = soil(dilation=25.0).model_copy(update={"softening": Softening(**curves)})
    (found,) = reduced([soft], 1.5, FactorOfSafety())
    law = found.softening
    assert law.strain == [0.01, 0.1]
    assert law.cohesion == pytest.approx([5e3 / 1.5, 0.0])
    assert [tan(radians(a)) for a in law.friction] == pytest.approx([tan(radians(a)) / 1.5 for a in (25.0, 20.0)])
    assert law.dilation == pytest.approx([min(20.0, law.friction[0]), min(15.0, law.friction[1])])
