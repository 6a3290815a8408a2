"""docs/discs.md: its examples run as they stand and find the closed forms; its scene is one; its functions do what it says."""

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

import colluvium
from coupler_protocol.scene.reader import build_scene

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "discs.md").read_text(encoding="utf-8")


def blocks(language):
    """Code blocks of the page."""
    return re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)


EXAMPLES = [code for code in blocks("python") if "print(" in code]


def test_there_are_two_examples():
    assert len(EXAMPLES) == 2


@pytest.mark.parametrize("code", EXAMPLES, ids=["collision", "slope"])
def test_an_example_prints_the_closed_form(code, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "docs/discs.md", "exec"), {})
    found, expected = map(float, re.findall(r"\d+\.\d+", capsys.readouterr().out))
    assert found == pytest.approx(expected, rel=2e-4)


def test_the_scene_of_the_page_is_one(tmp_path, monkeypatch):
    (text,) = blocks("toml")
    (tmp_path / "discs.csv").write_text("x,y,radius\n0.0,0.5,0.03\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    scene = build_scene(tomllib.loads(text))
    assert scene.grid is None
    assert scene.discs.file == str(tmp_path / "discs.csv")


def pulling(gravity):
    """Names of the example with a function `pull`, for a stage with this gravity."""
    (code,) = (block for block in blocks("python") if "def pull" in block)
    names = {}
    exec(compile(code, "docs/discs.md", "exec"), names)
    names["gravity"] = gravity
    return names


@pytest.mark.parametrize("time", ["static", "real"])
def test_a_held_disc_does_not_move_under_gravity(tmp_path, time):
    """The other disc falls, in real time by g t^2 / 2."""
    names = pulling(9.81)
    (tmp_path / "two.csv").write_text("x,y,radius\n0,0,0.03\n1,0,0.03\n", encoding="utf-8")
    soil = {"density": 2000.0, "spring": {"normal": 5e7, "shear": 2e7}}
    stage = {"name": "hold", "kind": "discs", "time": time, "gravity": 9.81, "until": {"steps": 200}}
    discs = {"radius": 0.03, "file": str(tmp_path / "two.csv"), "soil": soil}
    scene = colluvium.Scene(format=1, seed=1, discs=discs, stage=[{"name": "fill"}, stage])
    with colluvium.run(scene, out=tmp_path / "run", on_step=(1, names["pull"])) as run:
        way, seconds = run.discs(-1).displacement, run.info["stages"][1]["seconds_simulated"]
    assert way[1, 1] < 0.0
    assert np.abs(way[0]).max() < 1e-3 * abs(way[1, 1])  # the function is called after the first step, which still moves it
    if time == "real":
        assert way[1, 1] == pytest.approx(-0.5 * 9.81 * seconds**2, rel=0.02)
        assert len(names["reaction"]) == 200


def test_a_function_pulls_and_another_disc_is_held(tmp_path):
    """Three bonded discs, disc 0 held, 100 N at the last: its reaction, and 100 N over kn a contact."""
    names = pulling(0.0)
    R, overlap = 0.03, 1e-9
    rows = "".join(f"{k * (2 * R - overlap * R)!r},0,{R}\n" for k in range(3))
    (tmp_path / "row.csv").write_text("x,y,radius\n" + rows, encoding="utf-8")
    soil = {"density": 2000.0, "spring": {"normal": 5e7, "shear": 2e7}, "bond": {"tension": 1e4, "shear": 1e4}}
    stage = {"name": "pull", "kind": "discs", "damping": {"local": 0.7}, "until": {"steps": 2000}}
    discs = {"radius": R, "file": str(tmp_path / "row.csv"), "soil": soil}
    scene = colluvium.Scene(format=1, seed=1, discs=discs, stage=[{"name": "fill"}, stage])
    with colluvium.run(scene, out=tmp_path / "run", on_step=(1, names["pull"])) as run:
        way = run.discs(-1).displacement
    np.testing.assert_allclose(names["reaction"][-1], [100.0, 0.0], atol=1e-4)
    np.testing.assert_allclose(way[:, 0], 100.0 / 2.5e7 * np.arange(3), atol=1e-10)
