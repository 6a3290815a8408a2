"""Windows softer or stiffer than their zones are doubted in words, with both moduli and the springs that would do."""

import json
import tomllib

import pytest

from colluvium.forecast import check
from coupler_protocol.scene.reader import build_scene, read_scene
from tests.commands import run_colluvium
from tests.window_scenes import BOX, uniform

ZONES = 9 * 0.5e9 * 0.15e9 / (3 * 0.5e9 + 0.15e9)  # E of the paper's Table 1
SQUARE = [[1.0, 1.0], [5.0, 1.0], [5.0, 5.0], [1.0, 5.0]]


def doubted(scene):
    """Doubts about the windows' stiffness."""
    return [doubt for doubt in check.describe(scene)["doubts"] if doubt["key"].startswith("window[")]


def slope(configs, *changes):
    return read_scene(configs / "paper_slope.toml", changes)


def springs_of(doubt):
    """The springs that a remedy gives: {table: {"normal": .., "shear": ..}}."""
    _, _, text = doubt["remedy"].partition(": ")
    return {
        name: tomllib.loads(f"spring = {value}}}")["spring"]
        for name, _, value in (part.partition(".spring = ") for part in text.removesuffix("}").split("}, "))
    }


def test_the_papers_window_is_softer_and_its_remedy_matches(configs):
    (doubt,) = doubted(slope(configs))
    assert doubt["key"] == "window[0]"
    assert doubt["what"] == (
        "window 'band' is 14 times softer than the zones it replaces: its contacts give E 28.76e6 Pa, the zones have E 409.1e6 Pa"
    )
    assert doubt["remedy"].startswith("fit the discs with colluvium calibrate, or multiply all springs by 14.2: discs.soil")
    springs = springs_of(doubt)
    assert springs["discs.soil"] == pytest.approx({"normal": 14.22 * 5e7, "shear": 14.22 * 2e7}, rel=1e-3)
    changes = [f"{name}.spring={{ normal = {s['normal']}, shear = {s['shear']} }}" for name, s in springs.items()]
    matched = slope(configs, *changes)
    assert doubted(matched) == []
    (window,) = check.describe(matched)["windows"]
    assert window["young"] == pytest.approx(window["young_zones"], rel=1e-3)
    assert window["young_zones"] == pytest.approx(ZONES)


@pytest.mark.parametrize(("times", "word"), [(2.1, "stiffer"), (1.9, None), (1 / 1.9, None), (1 / 2.1, "softer")])
def test_less_than_a_factor_of_two_is_not_doubted(configs, times, word):
    stiffness = times * 409.1 / 28.76
    change = f"discs.soil.spring={{ normal = {5e7 * stiffness}, shear = {2e7 * stiffness} }}"
    found = doubted(slope(configs, change))
    assert [f"is 2.1 times {word} than" in doubt["what"] for doubt in found] == ([True] if word else [])


def test_zones_of_two_materials_count_by_area(configs):
    tables = uniform(BOX, SQUARE)
    rock = {"name": "rock", "density": 2700.0, "elastic": {"young": 8e9, "poisson": 0.2}}
    tables["material"].append(rock | {"region": [[0.0, 0.0], [3.0, 0.0], [3.0, 6.5], [0.0, 6.5]]})
    (window,) = check.describe(build_scene(tables))["windows"]
    assert window["young_zones"] == pytest.approx(0.5 * (8e9 + ZONES))


def test_stones_make_a_window_stiffer_also_mapped_ones(configs, tmp_path):
    """A map with half of the window's area as stone counts as a content of 0.5."""
    stone = {"spring": {"normal": 5e8, "shear": 5e8}, "density": 2700.0}
    corners = [[0.0, 0.0], [3.0, 0.0], [3.0, 6.0], [0.0, 6.0]]  # half of the window, and ground beside it
    (tmp_path / "map.csv").write_text("stone,x,y\n" + "".join(f"1,{x},{y}\n" for x, y in corners), encoding="utf-8")
    plain = uniform(BOX, SQUARE, stone=stone)
    mapped = plain | {"stones": {"body": "clump", "file": str(tmp_path / "map.csv")}}
    found = [check.describe(build_scene(tables))["windows"][0]["young"] for tables in (plain, mapped)]
    assert found[1] == pytest.approx(found[0] / (1.0 - 0.5))


def test_discs_without_shear_springs_have_a_stiffness(configs):
    tables = uniform(BOX, SQUARE)
    tables["discs"]["soil"] = tables["discs"]["soil"] | {"spring": {"normal": 5e9, "shear": 0.0}}
    assert check.describe(build_scene(tables))["windows"][0]["young"] > 0.0


def test_check_and_run_say_it_and_check_still_ends_with_0(configs):
    done = run_colluvium("check", configs / "paper_slope.toml", "--no-locate", "--no-limits")
    assert done.returncode == 0
    text = " ".join(done.stdout.split())
    assert "no problems found, 1 worth a second look" in text
    assert "window band: E of its contacts about 28.76e6 Pa, of the zones it replaces 409.1e6 Pa" in text
    assert "worth a second look: window[0]: window 'band' is 14 times softer than the zones it replaces" in text
    answer = json.loads(run_colluvium("check", configs / "paper_slope.toml", "--no-locate", "--no-limits", "--json").stdout)
    assert "14 times softer" in answer["doubts"][0]["what"]
    assert any("14 times softer" in line for line in check.opening(slope(configs)))


def test_discs_alone_have_no_zones_to_be_compared_with(configs):
    assert doubted(read_scene(configs / "quick_pile.toml")) == []
