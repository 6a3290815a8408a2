"""Changes by stage: the scene as it is in a stage, what is refused and with which remedy, and what is said of it."""

import copy
import tomllib

import pytest

from coupler_protocol.problems import SceneError
from coupler_protocol.scene.changes import after_stage, in_stage, record_in, words
from coupler_protocol.scene.reader import build_scene
from coupler_protocol.scene.rules.between_tables import doubts

NAME = "soil-rock mixture"


@pytest.fixture(scope="module")
def slope(configs):
    return tomllib.loads((configs / "quick_slope.toml").read_text(encoding="utf-8"))


def with_stage(data, index, **tables):
    data = copy.deepcopy(data)
    data["stage"][index] |= tables
    return data


def soil(**effects):
    return [{"name": NAME, **effects}]


def test_only_the_keys_that_are_given_change(slope):
    data = with_stage(slope, 3, material=soil(mohr_coulomb={"cohesion": 2e4}, elastic={"young": 2e8}, tension=False))
    scene = build_scene(with_stage(data, 3, discs={"soil": {"friction": {"coefficient": 0.2}, "bond": False}}))
    before, now = in_stage(scene, 2), in_stage(scene, 3)
    assert before.material == scene.material
    assert before.discs == scene.discs
    assert now.material[0].mohr_coulomb == scene.material[0].mohr_coulomb.model_copy(update={"cohesion": 2e4})
    a, b = scene.material[0].elastic, now.material[0].elastic
    assert b.bulk / b.shear == pytest.approx(a.bulk / a.shear)  # nu stays
    assert 9 * b.bulk * b.shear / (3 * b.bulk + b.shear) == pytest.approx(2e8)
    assert now.material[0].tension is None
    assert (now.discs.soil.bond, now.discs.soil.friction.coefficient) == (None, 0.2)
    assert now.discs.soil.spring == scene.discs.soil.spring
    assert set(words(scene, 3)) >= {
        f"material {NAME!r}: mohr_coulomb.cohesion 50000 -> 20000 Pa",
        f"material {NAME!r}: tension ends",
        "discs.soil: bond ends",
        "discs.soil: friction.coefficient 0.55 -> 0.2",
    }


def test_changes_last_but_those_of_a_discarded_stage(slope):
    data = with_stage(slope, 0, discard=True, material=soil(mohr_coulomb={"cohesion": 1e4}), record={"every": 7})
    scene = build_scene(data)
    cohesion = [in_stage(scene, i).material[0].mohr_coulomb.cohesion for i in range(4)]
    assert cohesion == [1e4, 5e4, 5e4, 5e4]
    assert after_stage(scene, 0).material == scene.material
    assert [record_in(scene, i).every == 7 for i in range(4)] == [True, False, False, False]
    scene = build_scene(with_stage(data, 0, discard=False))
    assert in_stage(scene, 3).material[0].mohr_coulomb.cohesion == 1e4
    assert record_in(scene, 3).every == 7
    assert record_in(scene, 3).history == scene.record.history


def test_without_changes_a_stage_has_the_scene_itself(slope):
    scene = build_scene(slope)
    assert all(in_stage(scene, i) is scene and after_stage(scene, i) is scene for i in range(4))
    assert words(scene, 3) == []


def test_alternative_keys_replace_each_other(slope):
    first = {"soil": {"dashpot": {"normal": 0.3, "shear": 0.1}}}
    data = with_stage(with_stage(slope, 2, discs=first), 3, discs={"soil": {"dashpot": {"restitution": 0.5}}})
    dashpot = in_stage(build_scene(data), 3).discs.soil.dashpot
    assert (dashpot.normal, dashpot.restitution, dashpot.shear) == (None, 0.5, 0.1)


def test_a_resolved_scene_is_read_again_as_the_same_scene(slope):
    changes = {"soil": {"bond": False}, "damping": {"local": 0.5}, "pair": [{"between": ["ring", "soil"], "bond": False}]}
    data = with_stage(slope, 2, discs={"pair": [{"between": ["soil", "ring"], "friction": {"coefficient": 0.1}}]})
    with pytest.raises(SceneError, match="there is no bond that could end"):
        build_scene(with_stage(data, 3, discs=changes))
    changes["pair"][0] = {"between": ["ring", "soil"], "friction": {"coefficient": 0.3}}
    scene = build_scene(with_stage(data, 3, discs=changes))
    assert build_scene(scene.resolved()) == scene
    assert in_stage(scene, 3).discs.pair[0].friction.coefficient == 0.3


@pytest.mark.parametrize(
    ("index", "tables", "key", "reason", "remedy"),
    [
        (3, {"material": [{"name": "clay", "tension": False}]}, "material[0].name", "no material is named", NAME),
        (3, {"material": soil()}, "material[0]", "changes nothing", "the effects that change"),
        (3, {"material": soil(mohr_coulomb={})}, "material[0].mohr_coulomb", "changes nothing", "false"),
        (3, {"material": soil(elastic=False)}, "material[0].elastic", "nothing holds", "other values"),
        (3, {"material": soil(mohr_coulomb={"dilation": 50.0})}, "material[0].mohr_coulomb", "exceeds friction", "use dilation"),
        (3, {"material": soil(softening={"strain": [0.1]})}, "material[0].softening", "nothing softens", "give at least one"),
        (3, {"material": soil(density=2e3)}, "material[0].density", "does not change", "gravity_factor"),
        (3, {"material": soil(region=[[0, 0], [1, 0], [1, 1]])}, "material[0].region", "does not change", "zones keep"),
        (3, {"discs": {"radius": 0.1}}, "discs.radius", "does not change", "keep their sizes"),
        (3, {"discs": {"porosity": 0.1}}, "discs.porosity", "does not change", "for all stages"),
        (3, {"record": {"energy": True}}, "record.energy", "does not change", "[record]"),
        (3, {"discs": {"soil": {"rolling": False}}}, "discs.soil.rolling", "no rolling that could end", "remove"),
        (3, {"discs": {"soil": {"rolling": {}}}}, "discs.soil.rolling", "changes nothing", "rolling = false"),
        (3, {"discs": {"stone": {"bond": False}}}, "discs.stone", "no material stone", "[discs.stone]"),
        (3, {"discs": {"soil": {"parallel_bond": {"tension": 1e5}}}}, "parallel_bond.shear", "missing", "begins in this stage"),
        (3, {"discs": {"bond_gap": 0.1}}, "discs.bond_gap", "quarter of the smallest radius", "at most"),
        (
            3,
            {"discs": {"soil": {"bond": False}, "bond_gap": 0.0}},
            "discs.bond_gap",
            "no material of discs has bonds",
            "add bond",
        ),
        (1, {"material": soil(tension=False)}, "material", "computes no steps", "the stage after it"),
        (0, {"discs": {"soil": {"bond": False}}}, "discs", "no disc moves", "kind couple"),
        (3, {"discs": {"soil": {"friction": {"coefficient": -0.2}}}}, "friction.coefficient", "greater than", "did you mean 0.2"),
    ],
)
def test_what_cannot_change_is_refused_with_a_remedy(slope, index, tables, key, reason, remedy):
    with pytest.raises(SceneError) as found:
        build_scene(with_stage(slope, index, **tables))
    problem = next(p for p in found.value.problems if p.key.startswith(f"stage[{index}]") and key in p.key)
    assert reason in problem.reason
    assert remedy in problem.remedy


def test_softening_fits_the_material_as_it_is_in_the_stage(slope):
    data = with_stage(slope, 3, material=soil(mohr_coulomb=False, softening={"strain": [0.1], "cohesion": [1e3]}))
    with pytest.raises(SceneError, match=r"stage\[3\]\.material\[0\]\.softening: softening needs Mohr-Coulomb"):
        build_scene(data)


def test_values_of_a_stage_are_doubted_like_those_of_the_scene(slope):
    data = with_stage(slope, 3, material=soil(mohr_coulomb={"cohesion": 50.0}))
    found = {path: (what, remedy) for path, what, remedy in doubts(build_scene(data))}
    what, remedy = found["stage", 3, "material", 0, "mohr_coulomb", "cohesion"]
    assert "nothing beside" in what
    assert "50e3" in remedy


def test_the_example_of_the_page_can_be_computed(slope, configs):
    page = (configs.parent / "docs" / "scene.md").read_text(encoding="utf-8")
    example = page.partition("## Changes from a stage on")[2].partition("```toml\n")[2].partition("```")[0]
    data = copy.deepcopy(slope)
    data["material"][0]["name"] = "clay"
    data["stage"][3:] = tomllib.loads(example)["stage"]
    scene = build_scene(data)
    assert len(words(scene, 3)) == 7
    assert in_stage(scene, 3).ring.friction.coefficient == 0.2
