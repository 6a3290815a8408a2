"""`colluvium calibrate` from the command line."""

import json

import pytest

from coupler_protocol import exits
from tests.colluvium.calibration.synthetic import scene_of
from tests.commands import run_colluvium

SOIL = ("calibrate.young=2e7", "calibrate.poisson=0.2", "calibrate.cohesion=1e4", "calibrate.friction=25.0")
ELASTIC = (
    "calibrate.fit=['young', 'poisson']",
    "calibrate.vary=['normal', 'ratio']",
    "calibrate.seeds=[1]",
    "lab.confinement=[1e5]",
)


def calibrate(scene, *words, sets=()):
    return run_colluvium("calibrate", scene, *words, *(word for text in sets for word in ("--set", text)))


def test_a_dry_run_gives_targets_start_and_cost(configs, tmp_path):
    done = calibrate(configs / "paper_slope.toml", "--dry-run", "--out", tmp_path / "out")
    assert done.returncode == exits.DONE
    assert "E 409 MPa, nu 0.364, q(50 kPa) 273 kPa" in done.stdout
    assert "material 'soil-rock mixture' of the window" in done.stdout
    assert "clumps, content 0.45" in done.stdout
    assert "at most 100; " in done.stdout
    assert not (tmp_path / "out").exists()


def test_problems_are_said_at_once_with_what_would_be_right(configs):
    done = calibrate(configs / "quick_lab.toml", "--dry-run", sets=("calibrate.sample='clump'", "calibrate.friction=30.0"))
    assert done.returncode == exits.SCENE
    for key in ("calibrate.sample", "calibrate.young", "calibrate.poisson", "calibrate.cohesion"):
        assert key in done.stderr
    done = calibrate(configs / "quick_lab.toml", "--dry-run", sets=("calibrate.vary=['stiffness']",))
    assert done.returncode == exits.SCENE
    assert "calibrate.vary" in done.stderr


def test_the_scene_is_not_overwritten(configs):
    scene = configs / "quick_lab.toml"
    done = calibrate(scene, "--dry-run", "--write", scene, sets=SOIL)
    assert done.returncode == exits.SCENE
    assert "this is the scene itself" in done.stderr


def test_a_copy_that_cannot_be_written_is_refused_before_anything_is_computed(tmp_path):
    scene = tmp_path / "scene.json"
    scene.write_text(json.dumps(scene_of({"young": 2e7}).model_dump(mode="json", exclude_none=True)))
    done = calibrate(scene, "--dry-run", "--write", tmp_path / "copy.toml", sets=SOIL)
    assert done.returncode == exits.SCENE
    assert "give the TOML file of the scene" in done.stderr


@pytest.fixture(scope="module")
def small(tmp_path_factory, configs):
    """A calibration of the moduli of tiny samples."""
    out = tmp_path_factory.mktemp("calibrate")
    done = calibrate(
        configs / "quick_lab.toml", "--out", out, "--write", out / "copy.toml", "--strict", sets=(*SOIL[:2], *ELASTIC)
    )
    return done, out


@pytest.mark.long
def test_a_real_laboratory_reaches_its_moduli(small, configs):
    from coupler_protocol.scene.reader import read_scene

    done, out = small
    assert done.returncode == exits.DONE, done.stderr + done.stdout
    assert "all targets are reached" in done.stdout
    answer = json.loads((out / "answer.json").read_text())
    young = next(row for row in answer["goals"] if row["goal"] == "young")
    assert young["mean"] == pytest.approx(2e7, rel=0.1)
    assert young["sd"] > 0.0
    assert answer["seeds"] == [1, 11, 12, 13]
    assert answer["tests"] == len((out / "trials.jsonl").read_text().splitlines())
    copy = read_scene(out / "copy.toml").discs.soil
    assert copy.spring.normal == answer["parameters"]["normal"] != read_scene(configs / "quick_lab.toml").discs.soil.spring.normal


@pytest.mark.long
def test_the_same_command_computes_nothing_again_and_has_the_same_answer(small, configs):
    done, out = small
    before, kept = json.loads((out / "answer.json").read_text()), (out / "trials.jsonl").read_bytes()
    stamps = {path: path.stat().st_mtime_ns for path in out.glob("trials/*/run.json")}
    again = calibrate(configs / "quick_lab.toml", "--out", out, "--quiet", sets=(*SOIL[:2], *ELASTIC))
    assert again.returncode == done.returncode
    after = json.loads((out / "answer.json").read_text())
    assert (out / "trials.jsonl").read_bytes() == kept
    assert stamps == {path: path.stat().st_mtime_ns for path in out.glob("trials/*/run.json")}
    assert {key: after[key] for key in after if key != "seconds"} == {key: before[key] for key in before if key != "seconds"}
