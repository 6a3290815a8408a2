"""Which dilation a search computes with, and what it says about it."""

import pytest

from coupler_protocol.scene.reader import read_scene
from fdm_server.fos.flow_rule import in_words, with_flow
from fdm_server.fos.ground import begin_trial, settle, with_zone_size


@pytest.fixture
def slope(configs):
    """A function: Dawson's slope (phi = psi = 20) with changed keys."""
    return lambda *changes: read_scene(configs / "dawson_slope.toml", changes)


def angles(scene):
    law = scene.material[0].mohr_coulomb
    return law.friction, law.dilation


def test_the_scene_decides_unless_asked(slope):
    scene = slope("material.0.mohr_coulomb.dilation=7.0")
    assert with_flow(scene) is scene
    assert angles(with_flow(slope('fos.flow="zero"'))) == (20.0, 0.0)
    assert angles(with_flow(slope('fos.flow="associated"', "material.0.mohr_coulomb.dilation=7.0"))) == (20.0, 20.0)


def test_softening_flows_by_the_same_rule(slope):
    soft = "material.0.softening={ strain = [0.01, 0.1], friction = [15.0, 10.0], dilation = [5.0, 0.0] }"
    assert with_flow(slope(soft, 'fos.flow="associated"')).material[0].softening.dilation == [15.0, 10.0]
    assert with_flow(slope(soft, 'fos.flow="zero"')).material[0].softening.dilation == [0.0, 0.0]


@pytest.mark.parametrize(("changes", "words"), [
    ((), "psi = phi (associated)"),
    (("material.0.mohr_coulomb.dilation=0.0",), "psi = 0 (non-associated)"),
    (("material.0.mohr_coulomb.dilation=7.5",), "psi = 7.5 of phi = 20 deg (non-associated)"),
    (('fos.flow="zero"',), "psi = 0 (non-associated)"),
    (("material.0.mohr_coulomb.dilation=0.0", "material.0.mohr_coulomb.friction=0.0"), "psi = phi = 0"),
])  # fmt: skip
def test_the_rule_is_told(slope, changes, words):
    assert in_words(slope(*changes)) == words


def test_materials_that_flow_differently_are_named(slope):
    scene = slope("material.0.mohr_coulomb.dilation=0.0")
    other = scene.material[0].model_copy(update={"name": "sand", "mohr_coulomb": slope().material[0].mohr_coulomb})
    scene = scene.model_copy(update={"material": [*scene.material, other]})
    assert in_words(scene) == f"psi = 0 (non-associated) in {scene.material[0].name!r}, psi = phi (associated) in 'sand'"


def test_trials_flow_as_asked(slope):
    """The kernel's own parameters: those of the scene with that dilation written into it."""
    written = with_zone_size(slope("material.0.mohr_coulomb.dilation=0.0"), 2.5)
    asked = with_zone_size(slope('fos.flow="zero"'), 2.5)
    found = [begin_trial(scene, settle(scene), 1.1)[0].material_law.mohr_coulomb for scene in (written, asked)]
    assert (found[0] == found[1]).all()
    associated = begin_trial(with_zone_size(slope(), 2.5), settle(asked), 1.1)[0].material_law.mohr_coulomb
    assert (associated != found[0]).any()
