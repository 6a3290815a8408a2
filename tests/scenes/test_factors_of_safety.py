"""configs/dawson_slope.toml, griffiths_lane.toml and paper_slope.toml through `colluvium fos`, as a user would run them."""

import json

import pytest

from tests.commands import run_colluvium

pytestmark = pytest.mark.long

PNG = b"\x89PNG"


def fos(scene, out, *arguments):
    """(fos.json, standard output) of a search."""
    done = run_colluvium("fos", scene, "--out", out, "--quiet", *arguments)
    assert done.returncode == 0, done.stderr
    return json.loads((out / "fos.json").read_text()), done.stdout


def test_dawson_extrapolated(configs, tmp_path):
    """1.00 by limit analysis (log spiral): within 1 % at no zone size, from meshes of H/8, H/12 and H/16."""
    sizes = f"fos.zone_sizes={[10 / 8, 10 / 12, 10 / 16]}"
    found, printed = fos(configs / "dawson_slope.toml", tmp_path / "out", "--set", sizes)
    assert found["quantity"] == "factor of safety"
    assert [m["zone_size"] for m in found["meshes"]] == [10 / 8, 10 / 12, 10 / 16]
    assert found["extrapolation"]["value"] == pytest.approx(1.0, abs=0.01)
    assert f"extrapolated to zone size 0: {found['extrapolation']['value']:.4f}" in printed
    for name in ("mechanism", "plastic_zones", "trials", "meshes"):
        assert (tmp_path / "out" / f"{name}.png").read_bytes().startswith(PNG)


def test_griffiths_lane(configs, tmp_path):
    """1.368 (limit analysis) to 1.4 (their finite elements)."""
    found, _ = fos(configs / "griffiths_lane.toml", tmp_path / "out", "--no-pictures")
    (mesh,) = found["meshes"]
    assert mesh["value"] == pytest.approx(1.37, abs=0.03)
    assert mesh["high"] - mesh["low"] <= 0.005 * mesh["value"]
    assert not mesh["undecided"]


def test_the_slope_of_the_paper(configs, tmp_path):
    """2.49 on its own grid (8 m, 45 degrees, psi = 0, tension .1 kPa); the window and its discs have no part in it."""
    arguments = ("--grid", "--no-pictures", "--set", "fos.bracket=[2.3,2.7]", "--json", tmp_path / "found.json")
    found, printed = fos(configs / "paper_slope.toml", tmp_path / "out", *arguments)
    assert found == json.loads((tmp_path / "found.json").read_text())
    assert printed == ""
    assert found["meshes"][0]["zones"] == 1620
    assert found["meshes"][0]["value"] == pytest.approx(2.49, abs=0.03)
    assert any("window" in line for line in found["ignored"])


def test_the_paper_slope_under_growing_gravity(configs, tmp_path):
    """By gravity, grown gradually, it bears 8.0 g: a number of another kind, and called so."""
    arguments = ("--grid", "--no-pictures", "--by", "gravity", "--set", "fos.bracket=[7.5,9.0]", "--set", "fos.resolution=0.02")
    found, printed = fos(configs / "paper_slope.toml", tmp_path / "out", *arguments)
    assert found["meshes"][0]["value"] == pytest.approx(8.0, abs=0.15)
    assert found["quantity"] == "gravity factor at collapse"
    assert "safety" not in printed


def test_other_meshes_of_a_scene_with_a_window_have_no_window(configs, tmp_path):
    """Columns and rows of a window are of its own mesh; the grid alone is searched, which has no part of it."""
    words = ("--grid", "--no-pictures", "--set", "fos.bracket=[2.3,2.8]", "--set", "fos.resolution=0.2")
    found, _ = fos(configs / "paper_slope.toml", tmp_path / "out", *words, "--set", f"fos.zone_sizes=[{2 / 3}]")
    (mesh,) = found["meshes"]
    assert mesh["low"] < 2.55 < mesh["high"]
