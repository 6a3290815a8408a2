"""`colluvium fos` on a small slope: every trial is kept, the frames are there, the rules are told, mistakes are named."""

import json

import numpy as np
import pytest

from colluvium import open_run
from colluvium.forecast.factor_of_safety import _extrapolated
from fdm_server.fos.extrapolation import extrapolate
from tests.commands import run_colluvium

COARSE = ("--set", "grid.zone_size=1.25", "--set", "fos.resolution=0.01")


@pytest.fixture(scope="module")
def searched(tmp_path_factory, configs):
    """(folder, content of fos.json, what was printed) of two meshes by --meshes."""
    out = tmp_path_factory.mktemp("fos") / "out"
    idle = ("--set", "coupling.mapping=paper")
    done = run_colluvium("fos", configs / "dawson_slope.toml", "--meshes", 2, "--out", out, *COARSE, *idle)
    assert done.returncode == 0, done.stderr
    return out, json.loads((out / "fos.json").read_text()), done


def test_every_trial_is_kept(searched):
    """Factor, verdict, steps, ratio, motion, seconds of each, and the spans they were judged from."""
    _, found, _ = searched
    assert [m["zone_size"] for m in found["meshes"]] == [1.25, 0.625]
    for mesh in found["meshes"]:
        assert {t["verdict"] for t in mesh["trials"]} >= {"rests", "fails"}
        assert mesh["low"] == max(t["factor"] for t in mesh["trials"] if t["verdict"] == "rests")
        assert mesh["high"] == min(t["factor"] for t in mesh["trials"] if t["verdict"] == "fails")
        for trial in mesh["trials"]:
            assert trial["steps"] == mesh["span"] * len(trial["spans"]["ratio"])
            assert trial["seconds"] > 0.0
            assert (trial["ratio"] <= found["criterion"]["ratio"]) or trial["verdict"] == "fails"


def test_a_frame_for_each_trial(searched):
    """The frame of the lowest failure shows the mechanism: the slope moves, the ground far behind it does not."""
    out, found, _ = searched
    mesh = found["meshes"][-1]
    with open_run(out / "mesh2") as run:
        assert [f.stage for f in run.frames] == [f"{t['factor']:.6g} {t['verdict']}" for t in mesh["trials"]]
        failing = min((t for t in mesh["trials"] if t["verdict"] == "fails"), key=lambda t: t["factor"])
        points = run.gridpoints(failing["frame"])
        speed = np.hypot(*points.velocity.T)
        assert points.velocity[speed.argmax(), 0] < 0.0  # out of the slope, which faces left
        assert speed[points.xy[:, 0] > 33.0].max() < 0.02 * speed.max()
        assert np.any(run.zones(failing["frame"]).plastic_state & 1)


def test_rules_and_criterion_are_told(searched):
    _, found, done = searched
    assert set(found["rules"]) == {"flow", "strength", "dilation", "tension"}
    assert found["rules"]["flow"] == "psi = phi (associated)"
    assert "gravity: 10 m/s2" in done.stdout
    for rule in found["rules"].values():
        assert rule in done.stdout
    assert "rests at ratio 1e-05" in done.stdout
    assert "fails" in done.stderr  # progress


def test_both_flow_rules_beside_each_other(configs, tmp_path):
    """psi = 0 is the weaker one; each search has a folder, and fos.json has both."""
    arguments = ("--flow", "both", "--no-pictures", "--quiet", "--set", "fos.zone_sizes=[2.5]", "--set", "fos.resolution=0.02")
    done = run_colluvium("fos", configs / "dawson_slope.toml", "--out", tmp_path / "out", *arguments)
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "out" / "fos.json").read_text())["flows"]
    zero, associated = (found[flow]["meshes"][-1]["value"] for flow in ("zero", "associated"))
    assert 0.0 < associated - zero < 0.1
    assert json.loads((tmp_path / "out" / "psi_0" / "fos.json").read_text()) == found["zero"]
    assert (tmp_path / "out" / "psi_phi" / "mesh1").is_dir()
    assert f"psi = 0 (non-associated): factor of safety {zero:.4f} on zones of 2.5 m" in done.stdout
    assert f"psi = phi (associated): factor of safety {associated:.4f} on zones of 2.5 m" in done.stdout


def test_extrapolations_in_words():
    """A value, an interval where the order is low, and nothing where there is hardly any."""
    sizes, none = [1.0, 2.0, 4.0], [0.0] * 3
    words = [_extrapolated(extrapolate(sizes, [1.0 + 0.1 * h**p for h in sizes], none).as_dict()) for p in (1.0, 0.62, 0.3)]
    assert words[0].startswith("extrapolated to zone size 0: 1.0000 (order 1.00 observed;")
    assert words[1].startswith("at zone size 0: between 1.0000 and 1.0587 (the observed order, 0.62, is too low for a value:")
    assert words[2].startswith("no extrapolation to zone size 0: the observed order, 0.30, is too low")


def test_mistakes_are_named_before_anything_is_computed(configs, tmp_path):
    done = run_colluvium("fos", configs / "dawson_slope.toml", "--out", tmp_path / "out", "--set", "fos.bracket=[2.0,1.0]")
    assert done.returncode == 3
    assert "[low, high] with low < high" in done.stderr
    diagonals = ("--set", 'grid.fit="diagonals"', "--set", "fos.zone_sizes=[0.77]")
    done = run_colluvium("fos", configs / "dawson_slope.toml", "--out", tmp_path / "out", *diagonals)
    assert done.returncode == 3
    assert "fos.zone_sizes" in done.stderr


def test_discs_alone_have_no_factor(configs, tmp_path):
    done = run_colluvium("fos", configs / "quick_pile.toml", "--out", tmp_path / "out")
    assert done.returncode == 3
    assert "grid: discs alone have no factor of safety" in done.stderr
    assert not (tmp_path / "out").exists()


def test_ground_that_cannot_fail(configs, tmp_path):
    """Rock without a strength: said at once. A strength no factor reaches: no bracket, exit 6."""
    scene, rock = configs / "dawson_slope.toml", "material.0={name='rock',density=2000.0,elastic={bulk=1e8,shear=3e7}}"
    done = run_colluvium("fos", scene, "--out", tmp_path / "a", "--set", rock)
    assert done.returncode == 3
    assert "no material has a strength" in done.stderr
    strong = ("--set", "fos.zone_sizes=[1.25]", "--set", "material.0.mohr_coulomb.cohesion=1e9")
    done = run_colluvium("fos", scene, "--out", tmp_path / "b", *COARSE, *strong)
    assert done.returncode == 6
    assert "fails within the given steps" in done.stderr


def test_results_are_not_overwritten(configs, searched):
    done = run_colluvium("fos", configs / "dawson_slope.toml", "--out", searched[0], *COARSE)
    assert done.returncode == 4
    assert "--force" in done.stderr


def test_doubts_about_the_scene_are_printed_and_kept(searched):
    """Those of every mesh, with the remedy."""
    _, found, done = searched
    rows = [doubt for doubt in found["doubts"] if doubt["key"] == "coupling.mapping"]
    assert [doubt["mesh"] for doubt in rows] == [1, 2]
    for row in rows:
        assert f"worth a second look: mesh {row['mesh']}: coupling.mapping: {row['what']}; {row['remedy']}" in done.stdout
