"""report.html: one file, complete and compact."""

import base64
import json
import re
import zlib

import numpy as np
import pytest

from colluvium.figures import frames
from colluvium.html import player
from colluvium.html.packing import FLOOR, Packing
from colluvium.results import stones, window_fields
from colluvium.results.run import open_run
from coupler_protocol.files.recorder import FrameInfo, Recorder
from tests.colluvium.report_page import Page, decode

pytest.importorskip("cmcrameri")


def unpacked(packing):
    carried = zlib.decompress(base64.b64decode(packing.text()))
    return [decode(carried, entry) for entry in packing.arrays]


@pytest.fixture(scope="module")
def page(run_folder, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "report.html"
    with open_run(run_folder) as run:
        assert player.write(run, path) == path
    return Page(path)


def test_numbers_come_back_within_half_a_step():
    rng = np.random.default_rng(1)
    values = rng.normal(0.0, 1e5, 1000)
    values[7] = np.nan
    packing = Packing()
    numbers = [packing.reals(values, width) for width in (1, 2, 4)]
    for number, codes in zip(numbers, (2**8, 2**16, 2**32), strict=True):
        step = packing.arrays[number][4]
        assert step == pytest.approx(np.ptp(values[np.isfinite(values)]) / (codes - 2), rel=1e-12)
        np.testing.assert_allclose(unpacked(packing)[number], values, atol=0.5001 * step)


def test_decades_come_back_with_one_relative_error():
    values = np.append(np.geomspace(1e-6, 3.0, 500), [0.0, 1e-30])
    packing = Packing()
    packing.reals(values, logarithmic=True)
    np.testing.assert_allclose(unpacked(packing)[0], np.maximum(values, 3.0 * FLOOR), rtol=2e-4)


@pytest.mark.parametrize("values", [[], [5], [-1, 0, 7], [0, 254], [0, 255], [0, 70_000, 3]])
def test_whole_numbers_come_back(values):
    packing = Packing()
    packing.whole(np.array(values, dtype=int))
    assert unpacked(packing)[0].tolist() == values


def test_equal_arrays_and_constant_ones_cost_nothing():
    packing = Packing()
    assert packing.reals(np.full(9, 0.25)) == packing.reals(np.full(9, 0.25))
    assert packing.reals(np.full(9, np.nan)) != 0
    zero, nothing = unpacked(packing)
    assert zero.tolist() == [0.25] * 9
    assert np.isnan(nothing).all()


def test_one_file_without_a_network(page):
    written = page.text.replace(page.part("arrays"), "")
    assert not re.search(r"https?:|//[a-z]+\.[a-z]|<link[^>]+stylesheet|src=|@import|url\(", written)
    assert "default-src 'none'" in page.text


def test_the_page_fits_a_phone_and_prints_undistorted(page):
    """Nothing has a least width beyond a phone's; on paper the canvas has the shape of its pixels."""
    style = re.search("<style>(.*?)</style>", page.text, re.DOTALL)[1]
    widths = [int(w) for rule in re.findall(r"[^-](?:min-)?width: ([^;]*)", style) for w in re.findall(r"^(\d+)px", rule)]
    assert max(widths) <= 64
    assert not re.search(r"minmax\(\d{3,}px", style)
    stage = re.search(r"#stage \{(.*?)\}", style, re.DOTALL)[1]
    assert "object-fit: contain" in stage
    printed = re.search(r"@media print \{.*?#stage \{(.*?)\}", style, re.DOTALL)[1]
    assert "width: auto; height: auto" in printed


def test_all_frames_are_there(page, run_folder):
    with open_run(run_folder) as run:
        told = [(f["step"], f["stage"], f["gravity_factor"]) for f in page.run["frames"]]
        assert told == [(f.step, f.stage, f.gravity_factor) for f in run.frames]
        assert [len(f["windows"]) for f in page.run["frames"]] == [0, 0, 1, 1, 1, 1]
        assert [f["farthest"] for f in page.run["frames"]] == [frames.farthest(run, i) for i in range(6)]
    assert f'max="{len(told) - 1}"' in page.text


@pytest.mark.parametrize("frame", [0, 3, 5])
def test_zones_and_gridpoints_are_the_recorded_ones(page, run_folder, frame):
    """The stress is the one averaged at gridpoints."""
    grid = page.run["frames"][frame]["grid"]
    with open_run(run_folder) as run:
        zones, gridpoints, smoothed = run.zones(frame), run.gridpoints(frame), run.smoothed_stress(frame)
        assert not np.allclose(smoothed, zones.stress, rtol=1e-3)
        for axis in (0, 1):
            page.agree(grid["start"][axis], gridpoints.xy[:, axis])
            page.agree(grid["displacement"][axis], gridpoints.displacement[:, axis])
        for number, column in zip(grid["corners"], zones.corners.T, strict=True):
            assert np.array_equal(page.array(number), column)
        for key, column in (("sxx", 0), ("syy", 1), ("sxy", 3)):
            page.agree(grid["fields"][key], smoothed[:, column])
        for key in ("shear_strain", "shear_strain_rate"):
            number = grid["fields"][key]
            relative = 10.0 ** (0.5001 * page.step(number)) - 1.0
            floor = FLOOR * zones[key].max()
            np.testing.assert_allclose(page.array(number), np.maximum(zones[key], floor), rtol=relative)
        assert np.array_equal(page.array(grid["fields"]["plastic"]), zones.plastic_state)


def test_discs_contacts_and_bins_are_the_recorded_ones(page, run_folder):
    window = page.run["frames"][5]["windows"][0]
    with open_run(run_folder) as run:
        discs, contacts, bins = run.discs(5), run.contacts(5), window_fields.bins(run, 5)
        for axis in (0, 1):
            place = page.array(window["start"][axis]) + page.array(window["displacement"][axis])
            np.testing.assert_allclose(place, discs.xy[:, axis], atol=page.step(window["displacement"][axis]))
        page.agree(window["radius"], discs.radius)
        order = np.lexsort(contacts.ends.T[::-1])
        for number, column in zip(window["contacts"]["ends"], contacts.ends[order].T, strict=True):
            assert np.array_equal(page.array(number), column)
        page.agree(window["contacts"]["force"], contacts.normal_force[order])
        assert np.array_equal(page.array(window["contacts"]["bond"]), contacts.bond_state[order])
        page.agree(window["fields"]["syy"], window_fields.mean_stress(run, 5, bins)[:, 1])
        assert np.array_equal(page.array(window["bin"]), bins.of(window_fields.starting_places(discs)))


def test_what_does_not_change_is_carried_once(page):
    carried = page.run["frames"]
    assert len({tuple(f["grid"]["start"]) for f in carried}) == 1
    assert len({tuple(f["grid"]["corners"]) for f in carried}) == 2  # with and without the hole
    assert len({tuple(f["windows"][0]["start"]) for f in carried[2:]}) == 1
    assert len({f["windows"][0]["radius"] for f in carried[2:]}) == 1


def test_a_run_out_is_drawn_shorter(run_folder, tmp_path, monkeypatch):
    """The model is 20 m long; the last frame has moved by .8 m, twice as far as pictures may show now."""
    monkeypatch.setattr(frames, "REACH", 0.02)
    with open_run(run_folder) as run:
        told = Page(player.write(run, tmp_path / "report.html")).run
        drawn = min(1.0, 0.4 / frames.farthest(run, 5))
    assert [f["drawn"] for f in told["frames"]] == [1.0, 1.0, 1.0, 1.0, 1.0, pytest.approx(drawn, rel=1e-12)]
    assert drawn == pytest.approx(0.5, rel=1e-3)
    assert (told["calm"], told["motion"]) == (4, "capped")


def test_closing_table_histories_and_scene(run_folder, tmp_path):
    for file in run_folder.iterdir():
        (tmp_path / file.name).symlink_to(file)
    (tmp_path / "run.json").unlink()
    (tmp_path / "scene.json").unlink()
    stage = {
        "name": "overload <1>",
        "steps": 1200,
        "ended_by": "1200 steps",
        "gravity_factor": 9.0,
        "ratio_continuum": 1e-3,
        "ratio_discrete": [2e-3],
        "traction_difference": [0.087],
        "bonds_broken": [31],
        "seconds": dict.fromkeys(
            ("continuum", "waiting", "recording", "discrete", "waiting_discrete", "recording_discrete"), 1.5
        ),
    }
    found = {"threshold": 0.01, "failed_at": 6.9, "not_failed_at": 6.6, "level_through": 0.013, "level_around": 0.004}
    info = {"title": "A & B", "stages": [stage], "band": found | {"crosses_window": True}, "reason": "done", "exit_code": 0}
    (tmp_path / "run.json").write_text(json.dumps(info))
    (tmp_path / "scene.json").write_text(json.dumps({"title": "</pre><script>", "grid": {"large_strain": True}}))
    with open_run(tmp_path) as run:
        page = Page(player.write(run, tmp_path / "report.html"))
    assert "<h1>A &amp; B</h1>" in page.text
    assert '<td class="left">overload &lt;1&gt;</td><td class="right">1200</td>' in page.text
    assert "failed at 6.90 g (not at 6.60 g)" in page.text
    assert "&lt;/pre&gt;&lt;script&gt;" in page.text
    assert page.run["motion"] == "true"  # large strain: how it moved is how it would
    assert re.findall(r'aria-label="([^"]+) \[-\]"', page.text) == ["unbalanced force ratio", "gravity factor", "bonds broken"]
    assert page.text.count("<polyline") == 4  # two sides have a ratio


def record_noise(folder, count):
    """Frames as large as those of the paper's slope, in which nothing repeats but the grid and who touches whom."""
    rng = np.random.default_rng(7)
    x, y = np.meshgrid(np.arange(61) / 3.0, np.arange(28) / 3.0)
    first = (np.arange(27)[:, None] * 61 + np.arange(60)).ravel()
    zones = np.column_stack((first, first + 1, first + 62, first + 61))
    i, j = (a.ravel() for a in np.meshgrid(np.arange(59), np.arange(59)))
    places = 0.06 * np.column_stack((i, j)) + 5.0
    one = np.arange(59 * 59).reshape(59, 59)
    pairs = ((one[:, :-1], one[:, 1:]), (one[:-1], one[1:]))
    ends = np.concatenate([np.column_stack((first.ravel(), second.ravel())) for first, second in pairs])
    with (
        Recorder(folder / "fdm.rank0.vtkhdf", "continuum") as fdm,
        Recorder(folder / "dem.rank1.vtkhdf", "discrete") as dem,
    ):
        for number in range(count):
            info = FrameInfo(number, float(number), "overload", 1.0 + number)
            fdm.frame(
                info,
                points=np.column_stack((x.ravel(), y.ravel())),
                cells=zones,
                point_fields={"displacement": rng.normal(0.0, 0.01, (61 * 28, 2))},
                cell_fields={
                    "stress": rng.normal(-1e5, 1e4, (len(zones), 4)),
                    "shear_strain": rng.lognormal(-5.0, 1.0, len(zones)),
                    "shear_strain_rate": rng.lognormal(-15.0, 1.0, len(zones)),
                    "plastic_state": rng.integers(0, 5, len(zones)),
                },
            )
            moved = rng.normal(0.0, 0.01, places.shape)
            kept = rng.random(len(ends)) < 0.98
            dem.frame(
                info,
                points=places + moved,
                cells=ends[kept],
                point_fields={
                    "id": np.arange(len(places)),
                    "radius": np.full(len(places), 0.03),
                    "displacement": moved,
                    "velocity": 1e-3 * moved,
                },
                cell_fields={
                    "disc_a": ends[kept, 0],
                    "disc_b": ends[kept, 1],
                    "normal_force": rng.lognormal(9.0, 1.0, kept.sum()),
                    "bond_state": rng.integers(1, 4, kept.sum()),
                },
            )


def test_a_hundred_frames_of_the_paper_stay_under_ten_megabytes(tmp_path):
    size = []
    for count in (2, 4):
        folder = tmp_path / str(count)
        folder.mkdir()
        record_noise(folder, count)
        with open_run(folder) as run:
            size.append(player.write(run, folder / "report.html").stat().st_size)
    assert size[0] + 98 * (size[1] - size[0]) / 2 < 10e6


def test_a_frame_that_blew_up_does_not_spoil_the_others(tmp_path):
    ends = np.array([[0, 1], [1, 2]])
    start = np.array([[0.0, 0.0], [0.1, 0.0], [0.1, 0.1]])
    with Recorder(tmp_path / "dem.rank1.vtkhdf", "discrete") as recorder:
        for number, moved in enumerate((0.0, 0.001, np.nan)):
            recorder.frame(
                FrameInfo(number, float(number), "overload", 1.0),
                points=start + moved,
                cells=ends,
                point_fields={
                    "id": np.arange(3),
                    "radius": np.full(3, 0.05),
                    "displacement": np.full((3, 2), moved),
                    "velocity": np.full((3, 2), moved),
                },
                cell_fields={"disc_a": ends[:, 0], "disc_b": ends[:, 1], "normal_force": np.full(2, 5.0 + moved)},
            )
    with open_run(tmp_path) as run:
        page = Page(player.write(run, tmp_path / "report.html"))
    assert [f["farthest"] for f in page.run["frames"]] == [0.0, pytest.approx(0.001 * np.sqrt(2.0)), None]
    assert page.run["calm"] == 1
    assert page.run["quantities"][0]["run"]["high"] == pytest.approx(0.001 * np.sqrt(2.0))
    assert [len(f["windows"]) for f in page.run["frames"]] == [1, 1, 0]


def test_stones_move_with_their_discs(tmp_path):
    corners = np.array([[0.0, 0.0], [0.4, 0.0], [0.4, 0.3], [0.5, 0.5], [0.8, 0.5], [0.8, 0.7], [0.5, 0.7]])
    start = np.array([[0.1, 0.1], [0.3, 0.1], [0.6, 0.6], [0.7, 0.6], [0.1, 0.6]])
    turn = np.array([[np.cos(0.2), -np.sin(0.2)], [np.sin(0.2), np.cos(0.2)]])
    constants = {"stone_corners": corners, "stone_start": np.array([0, 3, 7])}
    ends = np.array([[0, 1], [1, 2], [2, 3], [3, 4]])
    with Recorder(tmp_path / "dem.rank1.vtkhdf", "discrete", constants=constants) as recorder:
        for number in range(2):
            now = start @ turn.T if number else start
            recorder.frame(
                FrameInfo(number, float(number), "couple", 1.0),
                points=now,
                cells=ends,
                point_fields={
                    "id": np.arange(5),
                    "radius": np.full(5, 0.05),
                    "displacement": now - start,
                    "velocity": now - start,
                    "stone": np.array([0, 0, 1, 1, -1]),
                },
                cell_fields={"disc_a": ends[:, 0], "disc_b": ends[:, 1], "normal_force": np.arange(4.0)},
            )
    with open_run(tmp_path) as run:
        page = Page(player.write(run, tmp_path / "report.html"))
        outlines = np.concatenate(stones.outlines(run, 1))
    window = page.run["frames"][1]["windows"][0]
    assert page.array(window["stone"]).tolist() == [0, 0, 1, 1, -1]
    assert page.array(window["stones"]["corners"]).tolist() == [3, 4]
    for axis in (0, 1):
        place = page.array(window["stones"]["start"][axis]) + page.array(window["stones"]["displacement"][axis])
        np.testing.assert_allclose(place, outlines[:, axis], atol=1e-5)
        np.testing.assert_allclose(place, (corners @ turn.T)[:, axis], atol=1e-5)
    assert page.run["frames"][1]["grid"] is None
