"""What a factor divides: each strength of zones and discs, nothing else, as tables that a stage accepts."""

from math import radians, tan

import pytest

from colluvium.safety import scenes
from colluvium.safety.reduction import changes, reduced_discs, unknown
from coupler_protocol.scene.changes import after_stage
from tests.colluvium.safety.small_slope import SOIL, scene, tables

CEMENT = {"normal_stiffness": 1e9, "shear_stiffness": 4e8, "tension": 2e4, "shear": 3e4}
STONE = SOIL | {"rolling": {"coefficient": 0.2}}
FULL = {
    "soil": SOIL | {"rolling": {"coefficient": 0.1}},
    "stone": STONE,
    "pair": [{"between": ["soil", "stone"], "parallel_bond": CEMENT}],
}


def test_discs_of_the_stage_are_the_reduced_ones(configs):
    """Every strength over F: tables of the stage, as the discs read them, equal the reduced table; stiffnesses stay."""
    data = tables(configs, **FULL)
    base = scenes.checked(scenes.base_tables(scenes.checked(data)))
    trial = scenes.checked(scenes.trial_tables(base, scenes.base_tables(base), 1.6, 1000))
    now = after_stage(trial, len(trial.stage) - 1).discs
    assert now == reduced_discs(base.discs, 1.6)
    assert now.soil.friction.coefficient == pytest.approx(0.55 / 1.6)
    assert now.stone.rolling.coefficient == pytest.approx(0.2 / 1.6)
    assert (now.soil.bond.tension, now.soil.bond.shear) == pytest.approx((1.5e3 / 1.6, 3.5e3 / 1.6))
    (pair,) = now.pair
    assert (pair.parallel_bond.tension, pair.parallel_bond.shear) == pytest.approx((2e4 / 1.6, 3e4 / 1.6))
    assert (pair.parallel_bond.normal_stiffness, now.soil.spring) == (1e9, base.discs.soil.spring)


@pytest.mark.parametrize(("rule", "tension"), [("kept", 100.0), ("reduced", 50.0)])
def test_zones_of_the_stage_follow_the_rules_of_the_grid(configs, rule, tension):
    data = tables(configs)
    data["fos"] |= {"tension": rule}
    base = scenes.checked(scenes.base_tables(scenes.checked(data)))
    trial = scenes.checked(scenes.trial_tables(base, scenes.base_tables(base), 2.0, 1000))
    (material,) = after_stage(trial, len(trial.stage) - 1).material
    assert material.mohr_coulomb.cohesion == 25e3
    assert tan(radians(material.mohr_coulomb.friction)) == pytest.approx(0.5 * tan(radians(30.0)))
    assert material.tension.strength == tension
    assert material.elastic == base.material[0].elastic


def test_control_discs_lose_strength_with_the_ring_table(configs):
    data = tables(configs) | {"ring": {"friction": {"coefficient": 0.4}}}
    assert changes(scenes.checked(data), 2.0)["ring"] == {"friction": {"coefficient": 0.2}}


def test_no_effect_of_discs_is_unknown(configs):
    """A law of the discs that is added later must be given its strengths, or be named as having none."""
    found = scene(configs, **FULL)
    assert unknown(found.discs, found.ring) == []
