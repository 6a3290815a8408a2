"""configs/mapped_stones.toml from the command line: stones traced from a photograph, by the numbers of the map."""

import json

import numpy as np
import pytest

from colluvium import open_run
from colluvium.figures import mesostructure
from coupler_protocol.geometry import polygon_area
from tests.commands import run_colluvium


@pytest.fixture(scope="module")
def ran(tmp_path_factory, configs):
    out = tmp_path_factory.mktemp("mapped") / "run"
    done = run_colluvium("run", configs / "mapped_stones.toml", "--out", out, "--quiet")
    assert done.returncode == 0, done.stderr
    return out, done


def photographed(configs):
    """Polygons of the map in metres, straight from the file, and those the window's right edge at 2.5 m cuts."""
    features = json.loads((configs / "mapped_stones.geojson").read_text(encoding="utf-8"))["features"]
    for feature in features:
        parts = feature["geometry"]["coordinates"]
        for part in [parts] if feature["geometry"]["type"] == "Polygon" else parts:
            yield np.array(part[0][:-1]) * [2.5e-3, -2.5e-3] + [0.0, 2.0]


def test_the_window_holds_the_map(ran, configs):
    out, done = ran
    assert "11 stones" in done.stdout
    expected = list(photographed(configs))
    inside = [corners for corners in expected if corners[:, 0].max() <= 2.5]
    assert (len(expected), len(inside)) == (11, 10)
    with open_run(out) as run:
        found = run.stones()
        window = run.info["windows"][0]
        assert window["stone_content"] == pytest.approx(0.38883883928571, rel=1e-12)
        assert window["stone_content"] * 5.0 == pytest.approx(sum(map(polygon_area, found)), rel=1e-12)
        assert window["stones_without_discs"] == 0
        assert window["stone_azimuth"]["resultant"] == pytest.approx(0.42940376, rel=1e-6)
        areas = sorted(map(polygon_area, found))
        whole = sorted(abs(polygon_area(corners)) for corners in inside)
        for area in whole:
            assert min(abs(area - a) for a in areas) < 1e-12
        assert sum(areas) - sum(whole) < max(abs(polygon_area(c)) for c in expected)  # the rest: stone D, cut
        assert max(outline[:, 0].max() for outline in found) == 2.5


def test_it_rests_with_its_weight_on_the_ground(ran):
    with open_run(ran[0]) as run:
        assert run.info["stages"][1]["ended_by"].startswith("ratio")
        discs = run.discs(-1)
        soil = 2000.0 * np.pi * (discs.radius[discs.stone < 0] ** 2).sum()
        stones = 2700.0 * sum(map(polygon_area, run.stones()))
        assert run.history("wall_force_y", 1)[1][-1] == pytest.approx(-9.81 * (soil + stones), rel=5e-3)


def test_check_names_a_missing_map(configs):
    done = run_colluvium("check", configs / "mapped_stones.toml", "--set", "stones.file=gone.geojson")
    assert done.returncode == 3
    assert "gone.geojson: there is no such file" in done.stderr + done.stdout
    done = run_colluvium("check", configs / "mapped_stones.toml")
    assert done.returncode == 0
    assert f"as mapped in {configs / 'mapped_stones.geojson'}" in done.stdout.replace("\n", "")


def test_its_picture(ran):
    """The figure of the mesostructure shows the map's content, and sizes and azimuths without a distribution."""
    with open_run(ran[0]) as run:
        window, sizes, azimuths = mesostructure.draw(run).axes
    assert "C = 38.88 %, 11 stones" in window.get_title("left") + window.get_title()
    assert len(sizes.lines) == 1
    assert len(azimuths.patches) == 6
