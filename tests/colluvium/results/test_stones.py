"""Recorded stones: outlines that follow their discs, fabric by kind of contact, stress with rigid bodies."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
import shapely

from colluvium.figures import chains, displacement, mesostructure
from colluvium.results import stones, window_fields
from colluvium.results.fabric import KINDS
from colluvium.results.rank_file import NotRecordedError
from colluvium.results.run import open_run
from coupler_protocol.files.recorder import FrameInfo, Recorder

FIRST = np.array([[0.0, 0.0], [0.4, 0.0], [0.4, 0.2], [0.2, 0.1], [0.0, 0.2]])
SECOND = np.array([[0.6, 0.0], [0.9, 0.0], [0.7, 0.3]])
TURN = 0.3
R = np.array([[np.cos(TURN), -np.sin(TURN)], [np.sin(TURN), np.cos(TURN)]])
MOVE = np.array([0.05, -0.02])
STONE = np.array([-1, 0, 0, 0, 1, 1, -1, -1])
START = np.array([[0.5, 0.5], [0.1, 0.1], [0.3, 0.1], [0.05, 0.05], [0.65, 0.05], [0.8, 0.05], [0.2, 0.4], [0.4, 0.4]])
ENDS = np.array([[0, 7], [7, 6], [1, 2], [1, 6], [2, 7], [2, 4], [4, 5], [0, 2], [6, 0], [3, 4], [3, 5], [1, 3]])


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Eight discs, two stones; the first one moves and turns."""
    folder = tmp_path_factory.mktemp("stones")
    now = START.copy()
    now[STONE == 0] = START[STONE == 0] @ R.T + MOVE
    constants = {"stone_corners": np.concatenate([FIRST, SECOND]), "stone_start": np.array([0, 5, 8])}
    centroid = now.copy()
    for k, outline in enumerate((FIRST, SECOND)):
        middle = np.array(shapely.Polygon(outline).centroid.coords[0])
        centroid[k == STONE] = middle @ R.T + MOVE if k == 0 else middle
    with Recorder(folder / "dem.rank1.vtkhdf", "discrete", constants=constants) as recorder:
        recorder.frame(
            FrameInfo(0, 0.0, "couple", 1.0),
            points=now,
            cells=ENDS,
            point_fields={
                "id": np.arange(8),
                "radius": np.full(8, 0.05),
                "displacement": now - START,
                "control": np.zeros(8, dtype=int),
                "stone": STONE,
                "centroid": centroid,
            },
            cell_fields={"normal_force": np.arange(1.0, 13.0), "disc_a": ENDS[:, 0], "disc_b": ENDS[:, 1]},
        )
    (folder / "scene.json").write_text('{"stones": {"size": {"mean": 0.25, "sigma": 0.35, "min": 0.1, "max": 0.6}}}')
    with open_run(folder) as found:
        yield found


def test_outlines_move_and_turn_with_their_discs(run):
    placed = run.stones()
    assert [outline.tolist() for outline in placed] == [FIRST.tolist(), SECOND.tolist()]
    first, second = stones.outlines(run, 0)
    np.testing.assert_allclose(first, FIRST @ R.T + MOVE, atol=1e-12)
    np.testing.assert_allclose(second, SECOND, atol=1e-12)


def test_fabric_by_kind_leaves_out_contacts_inside_a_stone(run):
    number = {kind: run.fabric(0, kind=kind).contacts for kind in KINDS}
    assert number == {"soil-soil": 3, "soil-stone": 3, "stone-stone": 3}
    assert run.fabric(0).contacts == 9
    with pytest.raises(ValueError, match="stone-stone"):
        run.fabric(0, kind="rock-rock")


def test_bodies_of_discs_now_and_at_the_start(run):
    discs = run.discs(0)
    now, start = window_fields.body_centres(discs)
    soil = STONE < 0
    np.testing.assert_allclose(now[soil], START[soil], atol=1e-15)
    np.testing.assert_allclose(start[soil], START[soil], atol=1e-15)
    middle = np.array(shapely.Polygon(SECOND).centroid.coords[0])
    np.testing.assert_allclose(start[STONE == 1], [middle, middle], atol=1e-15)
    middle = np.array(shapely.Polygon(FIRST).centroid.coords[0])
    np.testing.assert_allclose(start[STONE == 0], np.tile(middle, (3, 1)), atol=TURN * 0.1)  # its lever from the discs' mean


def test_runs_without_stones(run_folder):
    with open_run(run_folder) as run:
        assert run.stones() == []
        assert stones.outlines(run, -1) == []
        assert mesostructure.missing(run) == "no stones"
        assert run.fabric(-1, kind="soil-soil") == run.fabric(-1)
        with pytest.raises(NotRecordedError):
            run.stones(rank=0)


def test_pictures(run):
    assert not mesostructure.missing(run)
    figure = mesostructure.draw(run)
    panel, sizes, azimuths = figure.axes
    content = (shapely.Polygon(FIRST).area + shapely.Polygon(SECOND).area) / (np.ptp(START, axis=0)).prod()
    assert panel.get_title(loc="left") == f"C = {100 * content:.2f} %, 2 stones"
    assert "at most" in sizes.get_legend_handles_labels()[1][1]
    assert sum(bar.get_height() for bar in azimuths.patches) == 2
    for module in (chains, displacement):
        drawn = module.draw(run)
        assert sum(len(c.get_paths()) == 2 for axes in drawn.axes for c in axes.collections) >= 1
        plt.close(drawn)
    plt.close(figure)


def test_side_by_side():
    window = np.array([[0.0, -0.1], [1.0, -0.1], [1.0, 0.4], [0.0, 0.4]])
    figure = mesostructure.draw_side_by_side(window, [[FIRST], [FIRST, SECOND]])
    assert [axes.get_title(loc="left")[:3] for axes in figure.axes] == ["(a)", "(b)"]
    plt.close(figure)
