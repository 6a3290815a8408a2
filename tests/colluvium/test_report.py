"""`report.write` draws what was recorded, each figure with its data and nothing else."""

import importlib
import json
import re
import shutil
import subprocess
import sys

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.text import Text

from colluvium import report
from colluvium.figures import assembly, chains, displacement, domain, frames, stress, style, vectors
from colluvium.html import player
from colluvium.results import walls
from colluvium.results.run import open_run
from coupler_protocol.files.recorder import FrameInfo, Recorder
from tests.colluvium.report_page import Page

pytest.importorskip("matplotlib")
pytest.importorskip("cmcrameri")


@pytest.mark.long
def test_every_figure_of_a_coupled_run_is_drawn(run_folder, tmp_path):
    seen, skipped = [], {}
    paths = report.write(run_folder, tmp_path / "pictures", progress=seen.append, skipped=skipped.setdefault)
    assert set(skipped) == {"mesostructure.png", "load_curves.png", "timeline.png"}
    assert skipped["timeline.png"].startswith("no trace")
    figures = [name for name, _, _ in report.FIGURES if f"{name}.png" not in skipped]
    assert [p.name for p in paths] == [*(f"{name}.png" for name in figures), "report.html"]
    assert paths == seen
    for path in paths[:-1]:
        assert path.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
        assert path.stat().st_size > 20_000


@pytest.mark.parametrize(
    ("file", "drawn"),
    [
        (
            "dem.rank1.vtkhdf",
            {"window", "displacement", "force_chains", "displacement_vectors", "fabric", "cracks", "histories", "report"},
        ),
        (
            "fdm.rank0.vtkhdf",
            {"mesh", "stress", "displacement", "shear_strain_rate", "shear_strain", "plastic_zones", "histories", "report"},
        ),
    ],
)
def test_one_side_alone_is_drawn(run_folder, tmp_path, file, drawn):
    shutil.copy(run_folder / file, tmp_path)
    paths = report.write(tmp_path)
    assert {p.stem for p in paths} == drawn
    assert {p.parent for p in paths} == {tmp_path / "report"}


PRINTED = [(module, function) for _, module, function in report.FIGURES]


@pytest.mark.parametrize(("module", "function"), PRINTED, ids=[name for name, _, _ in report.FIGURES])
def test_pictures_can_be_printed_190_mm_wide(request, tmp_path, module, function):
    """The resolution is the one asked for, no text is below 7 pt, and titles reach neither each other nor the edge."""
    drawing = importlib.import_module(f"colluvium.figures.{module}")
    drawn = 0
    for folder in ("run_folder", "stony_folder", "pile_folder"):
        with open_run(request.getfixturevalue(folder)) as run:
            if drawing.missing(run):
                continue
            figure = getattr(drawing, function)(run)
            drawn += 1
        path = tmp_path / f"{folder}.png"
        figure.savefig(path)
        width = figure.get_size_inches()[0]
        pixels = np.frombuffer(path.read_bytes()[16:24], ">u4")
        assert pixels[0] == pytest.approx(160 * width, abs=1.0)
        assert width <= 190 / 25.4 + 1e-2
        texts = [text for text in figure.findobj(Text) if text.get_text().strip() and text.get_visible()]
        assert min(text.get_fontsize() for text in texts) >= 7.0
        titles = [title for axes in figure.axes for title in (axes.title, axes._left_title) if title.get_text()]
        boxes = [title.get_window_extent() for title in titles]
        assert all(box.x1 <= figure.bbox.x1 + 1.0 for box in boxes), [title.get_text() for title in titles]
        for i, box in enumerate(boxes):
            assert not any(box.overlaps(other) for other in boxes[i + 1 :]), titles[i].get_text()
        plt.close(figure)
    assert drawn or module in ("timeline", "load_curves")  # no run here has a trace or moves a wall


def test_a_picture_without_data_does_not_stay_from_an_earlier_report(run_folder, tmp_path, monkeypatch):
    monkeypatch.setattr(report, "FIGURES", (("timeline", "timeline", "draw"),))
    (tmp_path / "timeline.png").write_text("of another run")
    report.write(run_folder, tmp_path)
    assert not (tmp_path / "timeline.png").exists()


def test_stress_is_compared_before_and_after_the_discs_come_in(run_folder):
    with open_run(run_folder) as run:
        assert stress.moments(run) == (1, 3)
        figure = stress.draw(run)
        titles = [axes.get_title(loc="left").replace("\n", " ") for axes in figure.axes]  # lines are broken to fit
        assert titles[0] == "vertical stress: equilibrium, step 1,000"
        assert titles[1] == "vertical stress: couple, step 3,000"
        labels = [axes.get_ylabel() for axes in figure.axes]
        assert "syy [kPa]\ntension +" in labels
        assert figure.get_suptitle() == "zones: stress averaged at gridpoints"
        shown = [c.get_clim() for axes in figure.axes[:2] for c in axes.collections if c.get_array() is not None]
        assert len(shown) == 2
        assert len(set(shown)) == 1  # one colour scale


def test_pictures_stop_before_the_slope_runs_away(run_folder):
    """The model is 20 m long; the last frame has moved by .8 m, less than a twentieth of it."""
    with open_run(run_folder) as run:
        assert frames.farthest(run, -1) == pytest.approx(0.8, rel=1e-3)
        assert frames.before_run_out(run) == [0, 1, 2, 3, 4, 5]
        assert frames.of_last_stage(run, 0, 4) == [4, 5]
        assert frames.last_of_stages(run, 1, 4) == [3, 5]


def test_of_a_run_away_only_the_last_frame_is_drawn(run_folder, monkeypatch):
    monkeypatch.setattr(frames, "REACH", 0.03)
    with open_run(run_folder) as run:
        assert frames.before_run_out(run) == [0, 1, 2, 3, 4]
        assert frames.of_last_stage(run, 0, 4) == [4, 5]
        assert frames.last_of_stages(run, 1, 4) == [3, 4, 5]
        assert frames.last_of_stages(run, 1, 1) == [5]
        part = frames.drawn_part(run, 5)
        assert part == pytest.approx(0.03 * 20.0 / 0.8, rel=1e-3)
        now, start = domain.discs_now(run, 5, 1), run.discs(2).xy
        assert np.hypot(*(now - start).T).max() == pytest.approx(0.6, rel=2e-2)
        titles = [axes.get_title(loc="left") for axes in displacement.draw(run).axes]
        assert titles[0] == "displacement: overload, step 4,000, 5 g"
        assert titles[2] == "displacement: overload, step 5,000, 9 g\nrun-out: displacements drawn at 0.75 of their length"


ALONE = (
    ("window", assembly.draw),
    ("displacement", displacement.draw),
    ("force_chains", chains.draw),
    ("displacement_vectors", vectors.draw),
)


@pytest.fixture(scope="module")
def pile_folder(tmp_path_factory):
    """Discs alone that fall from a column 1 m high to a pile 4 m wide, beside a wall at rest and under one that comes down."""
    folder = tmp_path_factory.mktemp("pile")
    column = 0.1 * np.column_stack([a.ravel() for a in np.meshgrid(np.arange(4), np.arange(10))])
    pile = np.column_stack((10.0 * column[:, 0] + 0.02 * column[:, 1], 0.1 * column[:, 1]))
    ends = np.array([[0, 1], [1, 2], [4, 5]])
    with Recorder(folder / "dem.rank1.vtkhdf", "discrete") as recorder:
        for number, (stage, xy) in enumerate((("fill", column), ("fall", 0.5 * (column + pile)), ("fall", pile))):
            recorder.history(100 * number, **{"wall_x:2": 1.0, "wall_y:2": 1.1 - 0.2 * number})
            recorder.frame(
                FrameInfo(100 * number, 0.5 * number, stage, 1.0),
                points=xy,
                cells=ends,
                point_fields={"id": np.arange(40), "radius": np.full(40, 0.05), "displacement": xy - column, "velocity": 0 * xy},
                cell_fields={"disc_a": ends[:, 0], "disc_b": ends[:, 1], "normal_force": np.full(3, 10.0**-number)},
            )
    walls = [{"name": None, "ends": [[-1.0, 0.0], [40.0, 0.0]]}, {"name": None, "ends": [[0.0, 1.1], [2.0, 1.1]]}]
    scene = {"title": "a pile", "discs": {"wall": walls}, "stage": [{"name": "fill"}, {"name": "fall", "kind": "discs"}]}
    (folder / "scene.json").write_text(json.dumps(scene))
    return folder


def test_the_last_frame_of_discs_alone_is_drawn(pile_folder):
    with open_run(pile_folder) as run:
        assert frames.before_run_out(run) == [0, 1, 2]  # positions are true, however far the discs went
        assert frames.drawn_part(run, 2) == 1.0
        for name, draw in ALONE[1:]:
            titles = [axes.get_title(loc="left") for axes in draw(run).axes]
            assert any("fall, step 200" in title for title in titles), (name, titles)


@pytest.mark.parametrize(("name", "draw"), ALONE, ids=[name for name, _ in ALONE])
def test_walls_are_drawn_where_they_are_and_do_not_widen_the_view(pile_folder, name, draw):
    with open_run(pile_folder) as run:
        axes = draw(run).axes
        places = [place for place in axes if place.get_title(loc="left")]
        drawn = [c.get_segments() for c in places[-1].collections if c.get_label() == "walls"]
        expected = walls.ends(run, 0 if name == "window" else 2)
        assert np.allclose(drawn[0], list(expected.values()))
        assert places[-1].get_xlim()[1] < 10.0


def test_walls_move_as_their_histories(pile_folder):
    with open_run(pile_folder) as run:
        found = [walls.ends(run, frame) for frame in range(3)]
    assert [list(one) for one in found] == [["1", "2"]] * 3
    assert all(np.array_equal(one["1"], [[-1.0, 0.0], [40.0, 0.0]]) for one in found)
    assert [one["2"][0, 1] for one in found] == pytest.approx([1.1, 0.9, 0.7])


def test_discs_without_a_ring_are_not_said_to_be_in_one(pile_folder, run_folder):
    with open_run(pile_folder) as alone, open_run(run_folder) as coupled:
        assert assembly.draw(alone).axes[0].get_title(loc="left") == "40 discs\nbetween 2 walls"
        assert re.fullmatch(r"[\d,]+ discs\nin a ring of \d+ control discs", assembly.draw(coupled).axes[0].get_title(loc="left"))


def test_the_page_has_the_walls_and_opens_at_the_end_of_discs_alone(pile_folder, tmp_path):
    with open_run(pile_folder) as run:
        page = Page(player.write(run, tmp_path / "report.html")).run
    assert (page["calm"], page["motion"]) == (2, "true")
    assert [frame["walls"][1][1] for frame in page["frames"]] == pytest.approx([1.1, 0.9, 0.7])
    assert page["box"][2] > 3.0  # the pile, not only the column


@pytest.mark.parametrize(
    ("unit", "largest", "expected"),
    [
        ("Pa", 3.0e5, "kPa"),
        ("Pa", 2.0e6, "MPa"),
        ("m", 0.02, "mm"),
        ("m", 1.5, "m"),
        ("N", 10.0, "N"),
        ("-", 5.0, "-"),
    ],
)
def test_units_a_reader_likes(unit, largest, expected):
    factor, name = style.readable(unit, np.array([0.0, -largest, np.nan]))
    assert name == expected
    assert 0.5 <= factor * largest < 1000.0


def test_importing_the_report_does_not_import_matplotlib():
    code = "import sys, colluvium.report; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
