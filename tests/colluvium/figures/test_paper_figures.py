"""The table of the paper's figures in docs/output.md, and that a coupled run with stones gives every picture it names."""

import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.collections import LineCollection

from colluvium import report
from colluvium.figures import assembly, chains, mesh, moments, vectors
from colluvium.figures import roses as contact_roses
from colluvium.results.run import open_run
from coupler_protocol.files.recorder import FrameInfo, Recorder

plt = pytest.importorskip("matplotlib.pyplot")
pytest.importorskip("cmcrameri")

DOCS = Path(__file__).resolve().parents[3] / "docs" / "output.md"


def table():
    """{number of the paper's figure: names of the files that show it}"""
    rows = re.findall(r"^\| (\d+) \| [^|]* \| ([^|]*) \|", DOCS.read_text(encoding="utf-8"), re.MULTILINE)
    return {int(number): re.findall(r"`(\w+\.png)`", files) for number, files in rows}


@pytest.mark.long
def test_a_coupled_run_with_stones_gives_every_figure_of_the_table(stony_folder, tmp_path):
    named, skipped = table(), []
    assert sorted(named) == list(range(7, 18))
    assert all(named.values())
    written = report.write(stony_folder, tmp_path, skipped=lambda *what: skipped.append(what))
    assert [name for name, _ in skipped] == ["load_curves.png", "timeline.png"]  # nothing is moved, and the run has no trace
    names = {path.name for path in written}
    assert {file for files in named.values() for file in files} <= names
    assert {f"{name}.png" for name, _, _ in report.FIGURES} == names - {"report.html"} | {"load_curves.png", "timeline.png"}
    assert all(path.stat().st_size > 15_000 for path in written)


def test_moments_are_the_initial_coupled_state_and_the_states(stony_folder):
    with open_run(stony_folder) as run:
        shown = moments.of_run(run, 1)
        assert [(words[0], frame) for words, frame in shown] == [("a", 3), ("b", 4), ("l", 5)]
        assert shown[1].words.splitlines() == ["b enters the window", "c through the window", "d complete, toe to crest"]
        assert [frame for _, frame in contact_roses.shown(run)] == [3, 4, 5]


def test_without_states_force_chains_show_the_ends_of_stages(run_folder):
    with open_run(run_folder) as run:
        figure = chains.draw(run)
        assert [axes.get_title(loc="left").split(",")[0] for axes in figure.axes] == ["couple", "overload"]
        plt.close(figure)


def test_force_chains_have_one_scale_and_show_something_in_each_panel(tmp_path):
    """Forces fall to a thousandth from frame to frame: lines are thin there, not absent."""
    start = np.array([[0.0, 0.0], [0.1, 0.0], [0.2, 0.0]])
    with Recorder(tmp_path / "dem.rank1.vtkhdf", "discrete") as recorder:
        for number, stage in enumerate(("fill", "fall", "rest")):
            recorder.frame(
                FrameInfo(number, float(number), stage, 1.0),
                points=start,
                cells=np.array([[0, 1], [1, 2]]),
                point_fields={"radius": np.full(3, 0.05), "displacement": 0.0 * start, "velocity": 0.0 * start},
                cell_fields={"normal_force": np.array([9e3, 0.0]) * 10.0 ** (-1.5 * number)},
            )
    with open_run(tmp_path) as run:
        figure = chains.draw(run)
    drawn = [c for axes in figure.axes for c in axes.collections if isinstance(c, LineCollection)]
    lines = [c for c in drawn if c.get_label() not in ("walls", "chains")]
    widths = [sorted(np.asarray(one.get_linewidths())) for one in lines]
    np.testing.assert_allclose([width[1] for width in widths], [3.0, 3.0 * 10**-0.75, 0.15], rtol=0.01)
    assert [width[0] for width in widths] == [0.0, 0.0, 0.0]  # no force, no line
    (key,) = figure.legends
    texts = [text.get_text() for text in key.get_texts()]
    assert texts[3:] == ["compression", "tension in a bond", "chain"]
    forces = [float(text.split()[0]) for text in texts[:3]]
    assert forces == pytest.approx([forces[0], 0.1 * forces[0], 0.01 * forces[0]], rel=1e-2)
    plt.close(figure)


def test_vectors_are_thinned_and_point_where_the_points_went(stony_folder, slope):
    with open_run(stony_folder) as run:
        figure = vectors.draw(run)
        outline = 5.0  # the window's longer side [m]
    quivers = [c for axes in figure.axes for c in axes.collections if hasattr(c, "U")]
    (key,) = [c for c in quivers if c.get_gid() == "key"]
    arrows = [c for c in quivers if c is not key]
    longest = np.quantile(np.hypot(*slope.slip_at(arrows[-1].XY, 0.8).T), 0.995)
    scale = vectors.Scale(longest, 4, vectors.LONGEST * outline / vectors.CELLS)
    np.testing.assert_allclose(key.U, scale.drawn * np.array([1.0, 0.75, 0.5, 0.25]), rtol=1e-9)
    texts = [text.get_text() for text in figure.axes[0].texts]
    assert [text.split()[1] for text in texts] == ["m", "mm", "mm", "mm"]
    assert len(arrows) == 3
    for quiver, amount in zip(arrows, (0.002, 0.3, 0.8), strict=True):
        assert 60 < quiver.N < 400
        moved = slope.slip_at(quiver.XY, amount)
        size = np.hypot(*moved.T)
        seen = size > 0.05 * size.max()
        turned = np.abs(np.angle(np.exp(1j * (np.arctan2(quiver.V, quiver.U) - np.arctan2(*moved.T[::-1])))))
        assert turned[seen].max() < 1e-9
        drawn = np.hypot(quiver.U, quiver.V)
        expected = scale.drawn * np.clip(1.0 + np.log10(size / scale.longest) / scale.decades, 0.0, 1.0)
        np.testing.assert_allclose(drawn[seen], expected[seen], rtol=1e-9)  # one scale for all panels
        assert scale.drawn / scale.decades * 0.95 < drawn.max() < scale.drawn * 1.001  # and something to see in each
    plt.close(figure)


def test_one_point_stays_in_each_square():
    rng = np.random.default_rng(3)
    xy = rng.uniform(-1.0, 1.0, (4000, 2))
    kept = vectors.thinned(xy, 0.25)
    squares = np.floor(xy[kept] / 0.25)
    assert len(kept) == 64 == len(np.unique(squares, axis=0))
    middle = (squares + 0.5) * 0.25
    for point, centre in zip(xy[kept], middle, strict=True):
        inside = (np.abs(xy - centre) <= 0.125).all(axis=1)
        assert np.hypot(*(point - centre)) == pytest.approx(np.hypot(*(xy[inside] - centre).T).min(), abs=1e-12)


def test_mesh_and_window_say_what_they_are_made_of(stony_folder, slope):
    ring, free = slope.ring_and_discs()
    xy, zones = slope.grid()
    left = zones[~slope.in_window(xy[zones].mean(axis=1))]
    triangles = (left[:, 2] == left[:, 3]).sum()
    with open_run(stony_folder) as run:
        drawn = mesh.draw(run)
        titles = [axes.get_title(loc="left") for axes in drawn.axes]
        assert titles[0] == "geometry: 20 m long, 12 m high"
        assert titles[1] == f"mesh: {len(left) - triangles:,} quadrilaterals, {triangles:,} triangles"
        plt.close(drawn)
        drawn = assembly.draw(run)
        titles = [axes.get_title(loc="left") for axes in drawn.axes]
        stones = int((run.discs(-1).stone >= 0).sum())
        assert titles[0] == f"{len(free):,} discs\nin a ring of {len(ring):,} control discs"
        assert titles[2] == f"{stones:,} of the discs\nmake up 6 stones"
        plt.close(drawn)
