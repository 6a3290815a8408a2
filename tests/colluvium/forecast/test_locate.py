"""Where a band of prescribed strain runs, and what is said of windows on it, beside it and off it."""

import tomllib
from types import SimpleNamespace

import numpy as np
import pytest
import shapely

from colluvium.forecast import locate
from colluvium.results import band_line
from colluvium.results.run import open_run
from coupler_protocol.criteria import shear_band
from coupler_protocol.files.recorder import FrameInfo, Recorder
from coupler_protocol.scene.reader import build_scene
from fdm_server.mesh.grid import build_grid

STRAIGHT = shapely.LineString([(5.0, 4.5), (16.25, 11.75)])
ARC = shapely.LineString([(4 + 11.8 * np.sin(a), 16 - 11.8 * np.cos(a)) for a in np.linspace(0.1, 1.21, 60)])


def strain_about(xy, line, most=0.2, width=0.5):
    """(n,) a bell about a line."""
    return most * np.exp(-((shapely.distance(line, shapely.points(xy)) / width) ** 2)) + 1e-5


@pytest.fixture
def cells_about(slope):
    """Cells and surface of the slope with a band about a line."""

    def make(line):
        xy, zones = slope.grid()
        return shear_band.cells(xy, zones, strain_about(shear_band.middles(xy, zones), line)), shear_band.ground(xy, zones)

    return make


@pytest.mark.parametrize("line", [STRAIGHT, ARC], ids=["straight", "arc"])
def test_the_line_follows_the_band_within_a_quarter_of_a_zone(cells_about, line):
    cells, surface = cells_about(line)
    level = shear_band.toe_to_crest(cells, surface)
    assert 0.05 < level < 0.2
    found = band_line.line_of_band(cells, surface, level)
    inner = shapely.points(found[2:-2])  # the ends lie at the ground, where there are no cells on one side
    assert len(found) > 15
    assert shapely.distance(line, inner).max() < 0.125
    assert found[0][0] < 6.0 < 14.0 < found[-1][0]


def test_the_way_through_a_box_is_where_the_line_cuts_its_outline():
    line = np.array([(0.0, 0.0), (4.0, 2.0), (8.0, 6.0)])
    assert band_line.crossing(line, shapely.box(2.0, 0.0, 6.0, 5.0)) == ((2.0, 1.0), (6.0, 4.0))
    assert band_line.crossing(line, shapely.box(0.0, 3.0, 1.0, 5.0)) is None
    np.testing.assert_allclose(band_line.even_points(np.array([(0.0, 0.0), (0.0, 1.0), (3.0, 1.0)]), 3), [(0, 0), (1, 1), (3, 1)])


@pytest.fixture
def tables(configs):
    """The quick scene on the grid of `slope`, with a stage of kind locate."""
    data = tomllib.loads((configs / "quick_slope.toml").read_text())
    data["grid"] |= {"zone_size": 0.5, "profile": [[0.0, 4.0], [4.0, 4.0], [12.0, 12.0], [20.0, 12.0]]}
    data["stage"].insert(1, {"name": "look", "kind": "locate", "gravity_factor": 9.0, "until": {"steps": 100}, "discard": True})
    return data


@pytest.fixture
def located(tables, tmp_path, slope):
    """located(columns, rows, most) -> answer for one window beside a straight band; or of a polygon."""

    def answer(columns=None, rows=None, most=0.2, polygon=None):
        place = {"columns": columns, "rows": rows} if polygon is None else {"polygon": polygon}
        tables["window"] = [{"name": "band", **place}]
        xy, zones = slope.grid()
        with Recorder(tmp_path / "fdm.rank0.vtkhdf", "continuum", "strained", {}) as recorder:
            strain = {"shear_strain": strain_about(shear_band.middles(xy, zones), STRAIGHT, most)}
            displacement = {"displacement": 0.0 * xy}
            info = FrameInfo(100, 100.0, "look", 9.0)
            recorder.frame(info, points=xy, cells=zones, point_fields=displacement, cell_fields=strain)
        scene = build_scene(tables)
        with open_run(tmp_path) as run:
            return locate.band_and_windows(run, scene), scene

    return answer


def test_a_window_on_the_band_is_crossed(located):
    found, _ = located([22, 25], [10, 20])  # x 11 to 13, y 5 to 10.5
    window = found["windows"][0]
    assert window["crosses"]
    assert window["level_around"] < 0.01 < found["level"]
    slope = (11.75 - 4.5) / (16.25 - 5.0)
    for x, point in ((11.0, window["enters"]), (13.0, window["leaves"])):
        assert point == pytest.approx([x, 4.5 + slope * (x - 5.0)], abs=0.13)
    assert window["ends"]["lower"] == pytest.approx(STRAIGHT.distance(shapely.LineString([(11, 5), (13, 5)])), abs=0.13)
    assert window["ends"]["upper"] == pytest.approx(STRAIGHT.distance(shapely.LineString([(11, 10.5), (13, 10.5)])), abs=0.13)
    said = locate.as_text(found)
    assert said[0].startswith("look: at 9.00 g, the grid alone: a band of ")
    assert said[1].startswith("the band crosses window band: it enters at (11.00, 8.")
    assert not any("warning" in sentence for sentence in said)


@pytest.mark.parametrize(("columns", "rows"), [([30, 33], [4, 9]), ([8, 11], [1, 4]), ([24, 33], [2, 5])])
def test_a_window_off_the_band_is_warned_of_and_a_better_one_named(located, columns, rows):
    found, _ = located(columns, rows)
    window = found["windows"][0]
    assert not window["crosses"]
    assert window["enters"] is window["leaves"] is None
    better = window["better"]
    assert [b - a for a, b in (better["columns"], better["rows"])] == [b - a for a, b in (columns, rows)]
    said = locate.as_text(found)[1]
    assert said.startswith(f"warning: the band misses window band: it passes {window['distance']:.1f} m from it")
    assert f"columns = {better['columns']}, rows = {better['rows']}" in said
    again, scene = located(better["columns"], better["rows"])
    assert again["windows"][0]["crosses"]
    middle = locate.outline(build_grid(scene), scene.window[0]).centroid
    assert middle.distance(shapely.LineString(again["line"])) == pytest.approx(better["off"], abs=1e-9)
    assert better["off"] <= 0.25


L_SHAPE = np.array([(0.0, 0.0), (3.0, 0.0), (3.0, 1.5), (1.5, 1.5), (1.5, 4.0), (0.0, 4.0)])


def test_an_l_on_the_band_is_crossed_where_its_arms_are(located):
    """The notch is no part of the L: the band leaves by the right side of the upright arm, whose end is the upper end."""
    found, _ = located(polygon=np.add(L_SHAPE, (11.0, 5.5)).tolist())
    window = found["windows"][0]
    assert window["crosses"]
    slope = (11.75 - 4.5) / (16.25 - 5.0)
    for x, point in ((11.0, window["enters"]), (12.5, window["leaves"])):
        assert point == pytest.approx([x, 4.5 + slope * (x - 5.0)], abs=0.13)
    assert window["ends"]["upper"] == pytest.approx(STRAIGHT.distance(shapely.LineString([(11, 9.5), (12.5, 9.5)])), abs=0.13)


def test_an_l_off_the_band_is_told_how_far_to_move(located):
    polygon = np.add(L_SHAPE, (14.0, 2.0))
    found, _ = located(polygon=polygon.tolist())
    better = found["windows"][0]["better"]
    assert "with the window moved by ({:.4g}, {:.4g}) m it would cross".format(*better["by"]) in locate.as_text(found)[1]
    again, scene = located(polygon=(polygon + better["by"]).tolist())
    assert again["windows"][0]["crosses"]
    middle = shapely.box(*locate.outline(build_grid(scene), scene.window[0]).bounds).centroid
    assert middle.distance(shapely.LineString(again["line"])) == pytest.approx(better["off"], abs=1e-9)


def test_a_window_that_the_band_only_touches_is_not_needed(located):
    """The band is wide enough to pass beside it."""
    found, _ = located([22, 25], [8, 16])
    window = found["windows"][0]
    assert not window["crosses"]
    assert window["enters"]
    assert "does not need window band: it enters at" in locate.as_text(found)[1]


def test_no_band_is_said_so(located):
    found, _ = located([22, 25], [10, 20], most=0.005)
    assert found["line"] == found["windows"] == []
    (said,) = locate.as_text(found)
    assert said.startswith("warning: look: at 9.00 g, the grid alone: no band of 1 % shear strain connects toe and crest (")


def test_the_scene_is_cut_to_what_the_grid_alone_computes(tables):
    scene = locate.grid_alone(build_scene(tables))
    assert [stage.name for stage in scene.stage] == ["equilibrium", "look"]
    assert (scene.window, scene.discs, scene.stones, scene.ring) == ([], None, None, None)
    assert build_scene(scene.model_dump(mode="json", exclude_none=True)).digest() == scene.digest()


def test_level_ground_has_no_band_to_locate(tables):
    tables["grid"] = {"kind": "box", "length": 20.0, "height": 12.0, "zone_size": 0.5}
    assert locate.stage_of(build_scene(tables)) is None


def test_without_such_a_stage_there_is_no_answer(tables):
    del tables["stage"][1]
    scene = build_scene(tables)
    assert locate.stage_of(scene) is None
    assert locate.band_and_windows(SimpleNamespace(stages=["equilibrium"]), scene) is None
