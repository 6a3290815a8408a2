"""Trials of a scene: what its samples are made of, when friction and bonds begin, how fast and how long they are tested."""

import pytest

from colluvium.lab.command import problems_of
from colluvium.lab.specimen import KINDS
from colluvium.lab.trials import samples_of, trial, trials_of
from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import build_scene, read_scene
from tests.colluvium.lab.lab_case import SOIL, STONE, STONES, scene_of

LAB = {"confinement": [5e4, 2e5], "seeds": [1, 2, 3], "width": 24.0}


@pytest.fixture(scope="module")
def paper(configs):
    return read_scene(configs / "paper_slope.toml")


@pytest.mark.parametrize("kind", KINDS)
def test_a_coupled_scene_gives_valid_scenes_of_its_soil_with_and_without_stones(paper, kind):
    found = trials_of(kind, paper, (1.0, 0.5))
    assert len(found) == 2 * 2 * 3 * (1 if kind == "brazilian" else 3)
    assert len({one.name for one in found}) == len(found)
    for one in found:
        scene = build_scene(one.tables)
        assert scene.grid is None
        assert (scene.stones is None) == (one.sample == "soil")
        assert scene.discs.soil.bond is None


def test_bonds_and_friction_begin_after_the_press():
    scene = scene_of(LAB)
    tables = trial("biaxial", scene, "soil", 1e5, 1).tables
    assert set(tables["discs"]["soil"]) == {"density", "spring"}
    begins = next(stage for stage in tables["stage"] if stage["name"] == "bond")["discs"]
    assert begins["soil"] == {"friction": SOIL["friction"], "bond": SOIL["bond"]}
    assert begins["bond_gap"] == 0.0
    rough = trial("biaxial", scene_of(LAB | {"press": "rough"}), "soil", 1e5, 1).tables
    assert "friction" in rough["discs"]["soil"]


def test_clusters_are_bonded_inside_from_the_start_and_clumps_need_no_bond():
    scene = scene_of(LAB, {"stone": STONE}, stones=STONES)
    cluster, clump = (trial("biaxial", scene, sample, 1e5, 1).tables for sample in ("cluster", "clump"))
    assert cluster["discs"]["stone"]["bond"] == STONE["bond"]
    assert "bond" not in clump["discs"]["stone"]
    assert (cluster["stones"]["body"], clump["stones"]["body"]) == ("cluster", "clump")


def test_pairs_of_materials_keep_their_values():
    pair = [{"between": ["soil", "ring"], "friction": {"coefficient": 0.1}}]
    pair += [{"between": ["soil", "soil"], "friction": {"coefficient": 0.2}, "bond": SOIL["bond"]}]
    tables = trial("shear", scene_of(LAB, {"pair": pair}), "soil", 1e5, 1).tables
    assert tables["discs"]["pair"] == []
    bond = next(stage for stage in tables["stage"] if stage["name"] == "bond")
    (own,) = bond["discs"]["pair"]
    assert set(own["between"]) == {"soil"}
    assert own["friction"] == {"coefficient": 0.2}


def test_half_the_rate_takes_twice_the_steps_to_the_same_strain():
    full, half = (trial("biaxial", scene_of(LAB), "soil", 1e5, 1, factor).loading for factor in (1.0, 0.5))
    assert half.strain == full.strain
    assert half.steps == pytest.approx(2 * full.steps, abs=2)


def test_a_test_scales_with_stiffness_and_size():
    """Ten times the stiffness, a tenth of the rate; twice the rows, half of the rate: the same steps a row."""
    soft = trial("biaxial", scene_of(LAB | {"width": 48.0}), "soil", 1e5, 1).loading
    stiff_soil = SOIL | {"spring": {"normal": 5e8, "shear": 2e8}}
    stiff = trial("biaxial", scene_of(LAB | {"width": 48.0}, {"soil": stiff_soil}), "soil", 1e5, 1).loading
    large = trial("biaxial", scene_of(LAB | {"width": 96.0}), "soil", 1e5, 1).loading
    assert stiff.rate == pytest.approx(0.1 * soft.rate)
    assert large.rate == pytest.approx(0.5 * soft.rate, rel=0.05)


def test_stiff_samples_are_packed_under_more_than_their_confining_stress():
    """A packing of 1.3e9 N/m often misses 50 kPa; without friction, the press releases it again."""
    stiff = {"soil": SOIL | {"spring": {"normal": 1.3e9, "shear": 1.3e8}}}
    soft, hard = (trial("biaxial", scene_of(LAB, discs), "soil", 5e4, 1).tables for discs in ({}, stiff))
    assert soft["discs"]["confinement"] == 5e4
    assert 1.4e5 < hard["discs"]["confinement"] < 1.5e5
    for tables in (soft, hard):
        walls = {wall["name"]: wall for wall in tables["discs"]["wall"]}
        assert walls["top"]["servo"]["pressure"] == 5e4


def test_which_samples_are_tested():
    assert samples_of(scene_of(LAB)) == ["soil"]
    assert samples_of(scene_of(LAB, {"stone": STONE}, stones=STONES)) == ["soil", "clump"]
    wanted = scene_of(LAB | {"samples": ["cluster"]}, {"stone": STONE}, stones=STONES)
    assert samples_of(wanted) == ["cluster"]


def test_scenes_that_cannot_be_tested_are_refused_with_a_remedy():
    lacking = problems_of(scene_of(LAB | {"samples": ["clump"]}), "scene.toml")
    assert "samples" in lacking[0].key
    assert "soil" in lacking[0].remedy
    with pytest.raises(SceneError, match="twice"):
        scene_of(LAB | {"seeds": [1, 1]})
