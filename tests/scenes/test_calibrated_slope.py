"""configs/calibrated_slope.toml: the window has the stiffness of its zones, and the slope hardly feels it."""

import pytest
from felt.levels import Hold, begun, continuum_alone, course, run_level
from felt.measures import compare, places_of

from colluvium.forecast import check
from coupler_protocol.scene.reader import read_scene

NAME, PAPER = "calibrated_slope.toml", "paper_slope.toml"


@pytest.fixture(scope="module")
def scene(configs):
    return read_scene(configs / NAME)


def test_check_finds_nothing_to_doubt(scene):
    found = check.describe(scene)
    assert found["doubts"] == []
    (window,) = found["windows"]
    assert window["young"] == pytest.approx(window["young_zones"], rel=0.1)


def test_it_differs_from_the_papers_slope_in_its_soil_stones_and_laboratory_only(scene, configs):
    paper = read_scene(configs / PAPER)
    own = scene.discs.model_copy(update={"soil": paper.discs.soil, "stone": paper.discs.stone})
    assert scene.model_copy(update={"title": paper.title, "lab": paper.lab, "discs": own}) == paper


@pytest.mark.long
def test_the_slope_hardly_feels_the_window(scene, tmp_path):
    """From 1 to 2 g, each held to rest: the paper's window settles 24 % more, with E 56 MPa (docs/window.md, to 3 g)."""
    coupled = begun(scene, 1000)
    hold = Hold(last=2)
    alone, found = (
        course(one, tmp_path / name, hold, lambda *level: run_level(*level, in_process=True))
        for one, name in ((continuum_alone(coupled), "alone"), (coupled, "coupled"))
    )
    level = compare(alone, found, places_of(scene), 2.0)
    assert abs(level["crest"]) < 0.05
    assert level["rim"] < 0.06
    assert max(abs(level[key]) for key in ("xx", "yy", "xy")) < 0.1
    assert level["E"] == pytest.approx(409.1e6, rel=0.2)
    assert level["crest_alone"] == pytest.approx(2.5e-3, rel=0.02)  # [m]
