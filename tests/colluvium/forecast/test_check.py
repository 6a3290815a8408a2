"""What `colluvium check` says about the continuum's grid and sides."""

import json
import tomllib

import pytest

from colluvium.forecast import check
from colluvium.running import processes
from coupler_protocol.scene.reader import build_scene, read_scene
from tests.commands import run_colluvium


def test_counts_and_sides_of_a_scene_without_windows(configs):
    found = check.describe(read_scene(configs / "hole.toml"))
    assert (found["columns"], found["zones"], found["gridpoints"]) == (24, 24 * found["rows"], 25 * (found["rows"] + 1))
    before, opened = found["stages"]
    assert before["sides"] == ["fix on left", "fix on bottom", "stress on outer", "stress on inner"]
    assert opened["sides"] == ["stress on inner"]
    assert before["gravity"] == 0.0


def test_scenes_with_boundaries_survive_as_toml(configs):
    for name in ("hole", "footing", "layered_slope", "quick_biaxial"):
        scene = read_scene(configs / f"{name}.toml")
        text = processes.as_toml(scene.model_dump(mode="json", exclude_none=True))
        assert build_scene(tomllib.loads(text)) == scene


@pytest.mark.parametrize(
    ("name", "parents"),
    [("griffiths_lane", {"damping", "material"}), ("quick_pile", {"grain", "discs"}),
     ("quick_slope", {"damping", "material", "grain", "discs"})],
)  # fmt: skip
def test_only_effects_that_could_act_are_listed(configs, name, parents):
    rows = check.effects(read_scene(configs / f"{name}.toml"))
    assert {row["effect"].partition(".")[0] for row in rows} == parents


def test_materials_have_zones_areas_and_both_pairs_of_moduli(configs):
    clay, rock = check.describe(read_scene(configs / "layered_slope.toml"))["materials"]
    assert clay["zones"] + rock["zones"] == 1346
    assert rock["drawn"] == pytest.approx(20 * 2.5 + 14 * 4.5)
    assert rock["area"] == pytest.approx(rock["drawn"], rel=0.01)
    assert clay["young"] == pytest.approx(9 * 50e6 * 20e6 / (3 * 50e6 + 20e6))
    assert clay["poisson"] == pytest.approx((3 * 50 - 2 * 20) / (2 * (3 * 50 + 20)))


def changed(configs, path, *changes):
    text = (configs / "griffiths_lane.toml").read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")
    return path


def test_a_scene_in_kilopascals_ends_at_check(configs, tmp_path):
    scene = changed(configs, tmp_path / "kpa.toml", ("83.3e6", "83.3e3"), ("38.5e6", "38.5e3"), ("10e3", "10.0"))
    for command in (("check", scene), ("run", scene, "--out", tmp_path / "out"), ("fos", scene, "--out", tmp_path / "fos")):
        done = run_colluvium(*command)
        assert done.returncode == 3
        assert "did you mean bulk = 83.3e6, shear = 38.5e6 (kPa)?" in done.stderr
        assert "did you mean 10e3 (10 kPa)?" in done.stderr
    assert run_colluvium("check", scene, "--set", "units=any").returncode == 0


def test_doubts_are_in_the_answer_the_run_its_log_and_the_closing_words(configs, tmp_path):
    scene = changed(configs, tmp_path / "c.toml", ("10e3", "10.0"), ("steps = 40000", "steps = 20"))
    done = run_colluvium("check", scene)
    assert "no problems found, 1 worth a second look" in done.stdout
    answer = json.loads(run_colluvium("check", scene, "--json").stdout)
    (doubt,) = answer["doubts"]
    assert doubt["key"] == "material[0].mohr_coulomb.cohesion"
    done = run_colluvium("run", scene, "--out", tmp_path / "out")
    assert done.returncode == 0
    assert "material soil: 512 zones" in done.stderr
    assert f"worth a second look: {doubt['key']}: {doubt['what']}" in " ".join(done.stdout.split())
    assert json.loads((tmp_path / "out" / "run.json").read_text(encoding="utf-8"))["doubts"] == [doubt]
    assert doubt["what"] in (tmp_path / "out" / "fdm.rank0.log").read_text(encoding="utf-8")


def test_doubts_about_discs_alone_are_in_their_run_too(configs, tmp_path):
    changes = ["stage.1.until.time=0.001", "stage.2.until.steps=10", "discs.radius=0.08", "discs.damping={local=0.5}"]
    options = [word for change in changes for word in ("--set", change)]
    done = run_colluvium("run", configs / "quick_pile.toml", "--out", tmp_path / "out", "--quiet", *options)
    assert done.returncode == 0
    (doubt,) = json.loads((tmp_path / "out" / "run.json").read_text(encoding="utf-8"))["doubts"]
    assert "bodies fall at 0.5 g" in doubt["what"]
    assert doubt["what"] in (tmp_path / "out" / "dem.rank1.log").read_text(encoding="utf-8")


def test_memory_is_estimated(configs):
    found = check.describe(read_scene(configs / "paper_slope.toml"))["memory_MB"]
    assert 1.0 < found["grid"] < 3.0
    assert 3.0 < found["discs"] < 7.0
