"""Counts of zones and discs are estimated before anything is meshed, and too many refused at once."""

import copy
import tomllib
from math import pi

import pytest

from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import build_scene
from coupler_protocol.scene.rules.between_tables import doubts
from coupler_protocol.scene.rules.sizes import MOST_DISCS, MOST_ZONES, checkpoint_of, discs_of, files_of, frames_of, zones_of
from fdm_server.mesh.grid import build_grid


@pytest.fixture
def scene_data(configs):
    return lambda name: tomllib.loads((configs / f"{name}.toml").read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    "name", ["quick_slope", "dawson_slope", "griffiths_lane", "layered_slope", "footing", "hole", "softening_slide"]
)
def test_the_estimate_is_the_mesh(scene_data, name):
    scene = build_scene(scene_data(name))
    assert zones_of(scene) == pytest.approx(len(build_grid(scene).zones), rel=0.2)


def test_the_estimate_of_discs_is_that_of_the_packing(scene_data):
    """Porosity 0.16 in 2 x 5.667 m, radii uniform in 0.03 (1 ± 0.25) m."""
    paper = build_scene(scene_data("paper_slope"))
    disc = pi * 0.03**2 * (1.0 + 0.25**2 / 3.0)
    assert discs_of(paper, paper.window[0]) == pytest.approx(0.84 * 2.0 * 17.0 / 3.0 / disc)


def refusal(data):
    with pytest.raises(SceneError) as found:
        build_scene(data)
    (problem,) = found.value.problems
    return problem


@pytest.mark.parametrize(
    ("name", "grid", "words", "remedy"),
    [
        ("softening_slide", {"zone_size": 0.001}, "1.4e+08 zones", "zones of at least 0.006 m"),
        ("footing", {"zone_size": 1e-6}, "zones", "zones of at least"),
        ("footing", {"zone_size": [1e-7, 1.0]}, "zones", "zones of at least"),
        ("dawson_slope", {"zone_size": 0.001}, "zones", "zones of at least"),
        ("hole", {"around": 20_000}, "zones", "around = "),
    ],
)
def test_too_many_zones_are_refused_with_the_size_that_would_do(scene_data, name, grid, words, remedy):
    data = scene_data(name)
    data["grid"] |= grid
    problem = refusal(data)
    assert problem.key.startswith("grid.")
    assert words in problem.reason
    assert f"at most {MOST_ZONES:,}" in problem.reason
    assert "GB" in problem.reason
    assert remedy in problem.remedy


@pytest.mark.parametrize("name", ["quick_slope", "quick_pile", "quick_notch"])
def test_too_many_discs_are_refused_with_the_radius_that_would_do(scene_data, name):
    data = scene_data(name)
    wrong = copy.deepcopy(data)
    wrong["discs"]["radius"] = 1e-5
    problem = refusal(wrong)
    assert problem.key == "window[0]"
    assert f"at most {MOST_DISCS:,}" in problem.reason
    data["discs"]["radius"] = float(problem.remedy.split("at least ")[1].split(" m")[0])
    assert discs_of(build_scene(data), build_scene(data).window[0]) <= MOST_DISCS


def test_meshes_of_a_search_are_counted_before_they_are_made(scene_data):
    data = scene_data("dawson_slope")
    data["fos"] = {"zone_sizes": [1.0, 1e-4]}
    problem = refusal(data)
    assert problem.key == "fos.zone_sizes[1]"
    assert "a mesh with zones of 0.0001 m would have about" in problem.reason


def test_frames_and_files_are_counted(scene_data):
    """Steps over record.every and one more a stage, 100 B a zone, 190 B a disc; and checkpoints: two inside of stages stay."""
    data = scene_data("quick_slope")
    scene = build_scene(data)
    steps = [stage["until"]["steps"] for stage in data["stage"] if "until" in stage]
    assert frames_of(scene) == sum(n // 200 + 1 for n in steps)
    zones, discs = zones_of(scene), discs_of(scene, scene.window[0])
    expected = frames_of(scene) * (100 * zones + 190 * discs) + 4 * (320 * zones + 400 * discs)
    assert files_of(scene) == pytest.approx(expected / 1e6 + 2 * checkpoint_of(scene))
    assert checkpoint_of(scene) == pytest.approx((320 * zones + 400 * discs) / 1e6, rel=0.3)
    data["record"]["every"] = 1
    data["stage"][0]["until"]["steps"] = 200_000
    said = {path: (what, remedy) for path, what, remedy in doubts(build_scene(data))}
    assert "up to 240,003 frames, about" in said["record", "every"][0]
    assert "record.every of 240 or so" in said["record", "every"][1]
