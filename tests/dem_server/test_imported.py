"""Discs from files: what is refused and in which words, stones without polygons, overlaps that begin calmly, windows."""

import numpy as np
import pytest
from verification.discrete.scenes import disc_file, tables
from window_case import OBLIQUE, packing_of, soil_discs

from coupler_protocol import disc_file as files
from coupler_protocol.interface import build_ring
from coupler_protocol.problems import SceneError
from coupler_protocol.scene_reader import build_scene
from dem_server import cycle, imported
from dem_server.contacts import contact_forces
from dem_server.effects import STONE
from dem_server.walls import make_walls

R = 0.05
STATIC = {"name": "rest", "kind": "discs", "damping": {"local": 0.7}, "until": {"ratio": 1e-6, "steps": 20000}}
REAL = {"name": "go", "kind": "discs", "time": "real", "until": {"time": 0.001}}
ROCK = {"density": 2700.0, "spring": {"normal": 5e8, "shear": 5e8}, "bond": {"tension": 1e6, "shear": 1e6}}


def written(folder, lines):
    path = folder / "discs.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return str(path)


def scene_of(file, stage=STATIC, **discs):
    return build_scene(tables([stage], {"file": file} | discs))


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        (["x,y", "0,0"], ["'radius' is missing", "columns: x, y, radius"]),
        (["x,y,radius,mass", "0,0,1,1"], ["'mass' is not known"]),
        (["x,y,radius,x", "0,0,1,1"], ["'x' is there twice"]),
        (["x,y,radius"], ["holds no discs"]),
        (["x,y,radius", "0,0,1", "1,zero,1", "2,0,-1", "3,0"], ["csv:3", "'zero' is no number", "csv:4", "positive", "csv:5"]),
        (["x,y,radius,material", "0,0,1,clay"], ["material 'clay' is not known"]),
        (["x,y,radius,material,stone", "0,0,1,stone,-1"], ["disc 1 is of material stone and has stone -1"]),
        (["x,y,radius,stone", "0,0,1,1.5"], ["'1.5' is no whole number"]),
    ],
)
def test_files_that_are_refused(tmp_path, lines, words):
    with pytest.raises(SceneError) as found:
        files.read(written(tmp_path, lines))
    for word in words:
        assert word in str(found.value)


def test_numbers_are_written_as_they_are_read(tmp_path):
    rng = np.random.default_rng(0)
    xy, radius, motion = rng.normal(size=(50, 2)), rng.uniform(0.1, 0.2, 50) ** 3, rng.normal(size=(50, 3))
    stone = rng.integers(-1, 3, 50)
    with open(tmp_path / "discs.csv", "w", encoding="utf-8", newline="") as file:
        files.write(file, xy, radius, stone, motion)
    found = files.read(tmp_path / "discs.csv")
    for read, wrote in zip(found, (xy, radius, motion, stone), strict=True):
        assert read.tobytes() == np.asarray(wrote).tobytes()


def test_a_rigid_stone_of_overlapping_discs(tmp_path):
    """Union of two discs at the distance s: area, centroid and polar moment in closed form; weight = density * area."""
    s, turn = 1.2 * R, 0.4
    along = np.array([np.cos(turn), np.sin(turn)])
    at = np.array([[1.0, 2.0], [1.0, 2.0] + s * along])
    lines = ["x,y,radius,material,stone", *(f"{x!r},{y!r},{R!r},stone,7" for x, y in at.tolist()), f"5.0,5.0,{R!r},soil,-1"]
    model, state, _ = imported.free_discs(scene_of(written(tmp_path, lines), stone=ROCK))
    half = np.arccos(0.5 * s / R)
    lens = 2.0 * R**2 * half - 0.5 * s * np.sqrt(4.0 * R**2 - s**2)
    area = 2.0 * np.pi * R**2 - lens
    assert state.weight[:2].sum() == pytest.approx(2700.0 * area, rel=1e-3)
    assert state.weight[2] == pytest.approx(2000.0 * np.pi * R**2, rel=1e-14)
    np.testing.assert_allclose(state.clumps.motion[0, :2], at.mean(axis=0), atol=1e-6)
    x = np.linspace(-R, R + s, 2001)
    y = np.linspace(-R, R, 1001)
    X, Y = np.meshgrid(x, y)
    inside = (X**2 + Y**2 < R**2) | ((X - s) ** 2 + Y**2 < R**2)
    gyration = ((X - 0.5 * s) ** 2 + Y**2)[inside].mean()
    assert state.clumps.gyration[0] == pytest.approx(gyration, rel=2e-3)
    assert model.material.tolist() == [STONE, STONE, 1]


def test_a_rigid_stone_falls_and_spins_as_its_discs_were_moving(tmp_path):
    """Spin 3 rad/s about a centroid that moves with (1, 2) m/s."""
    at, centre, spin = np.array([[0.0, 0.0], [2.0 * R, 0.0], [0.0, 2.0 * R]]), np.array([2.0 * R, 2.0 * R]) / 3.0, 3.0
    rows = [[x, y, R, 1.0 - spin * (y - centre[1]), 2.0 + spin * (x - centre[0]), spin] for x, y in at]
    lines = ["x,y,radius,vx,vy,spin,stone", *(",".join(map(repr, map(float, row))) + ",0" for row in rows)]
    _, state, _ = imported.free_discs(scene_of(written(tmp_path, lines), REAL, stone=ROCK))
    np.testing.assert_allclose(state.clumps.motion[0, 2:5], [1.0, 2.0, spin], rtol=1e-6)


def test_a_cluster_is_bonded(tmp_path):
    lines = ["x,y,radius,stone", *(f"{x!r},0.0,{R!r},0" for x in (0.0, 2.0 * R, 4.001 * R))]
    _, state, _ = imported.free_discs(scene_of(written(tmp_path, lines), stone=ROCK, body="cluster"))
    assert (state.bond_state == 1).sum() == 2
    assert np.abs(state.force).max() < 1e-6 * 5e8 * R  # the one that stood apart is held where it is


def test_stones_need_a_material(tmp_path):
    with pytest.raises(SceneError, match="no material"):
        imported.free_discs(scene_of(written(tmp_path, ["x,y,radius,stone", "0,0,1,0"])))


def test_overlaps_are_refused_in_real_time_and_calm_in_static_mode(tmp_path):
    """An overlap d of .8 of the radius stores kn d^2 / 2; before a static stage the two are drawn apart and stay there."""
    file = disc_file(tmp_path, [[0.0, 0.0, R], [0.96, 1.0, R], [1.2 * 0.6 * R, 1.2 * 0.8 * R, R]], "x,y,radius")
    with pytest.raises(SceneError, match=r"discs 1 and 3 overlap by 0.8 of the smaller radius, 1 pairs") as refused:
        imported.free_discs(scene_of(file, REAL))
    assert "static stage" in str(refused.value)
    model, state, report = imported.free_discs(scene_of(file))
    assert report["overlap_energy"] == pytest.approx(0.5 * 2.5e7 * (0.8 * R) ** 2, rel=1e-12)
    assert report["largest_overlap"] == pytest.approx(0.8, rel=1e-12)
    start = state.x.copy()
    contact_forces(model, state)
    model, left = imported.draw_apart(model, state)
    assert left["overlap_left"] < 1e-3
    np.testing.assert_allclose(state.x[[0, 2]].mean(axis=0), start[[0, 2]].mean(axis=0), atol=1e-12)
    assert state.x[1].tolist() == start[1].tolist()
    way = np.array([0.6, 0.8])
    assert (state.x[2] - state.x[0]) @ way == pytest.approx(2.0 * R, rel=1e-3)
    cycle.advance(model, state, 0.0, 500)
    assert np.hypot(*(state.x - start).T).max() < R


def test_discs_that_walls_hold_together_stay_as_they_are(tmp_path):
    """Three discs in a box of two diameters cannot part: each of four equal springs is shortened by half a radius."""
    file = disc_file(tmp_path, [[0.5 * R, 0.0, R], [1.5 * R, 0.0, R], [3.0 * R, 0.0, R]], "x,y,radius")
    model, state, _ = imported.free_discs(scene_of(file))
    state.walls = make_walls([[-0.5 * R, -1.0, -0.5 * R, 1.0], [3.5 * R, -1.0, 3.5 * R, 1.0]], np.zeros((2, 2)), model)
    contact_forces(model, state)
    model, left = imported.draw_apart(model, state)
    assert left["overlap_left"] == pytest.approx(0.5, rel=0.02)
    np.testing.assert_allclose(state.walls.force[:, 0], [-1.25e7 * R, 1.25e7 * R], rtol=0.02)


def test_two_discs_in_one_place_are_refused(tmp_path):
    file = disc_file(tmp_path, [[0.0, 0.0, R], [1.0, 0.0, R], [1.0, 0.0, 0.5 * R]], "x,y,radius")
    with pytest.raises(SceneError, match="discs 2 and 3 are in the same place"):
        imported.free_discs(scene_of(file))


def test_a_disc_on_a_wall_is_refused(tmp_path):
    scene = scene_of(disc_file(tmp_path, [[0.5, 0.5, R]], "x,y,radius"), wall=[{"ends": [[0.0, 0.0], [1.0, 1.0]]}])
    with pytest.raises(SceneError, match="disc 1 lies on wall 1"):
        imported.free_discs(scene)


def test_a_heap_of_strong_overlaps_comes_to_rest(tmp_path):
    """200 discs at random in a square that holds 60: they part without one of them shooting off."""
    xy = np.random.default_rng(3).uniform(0.0, 0.8, (200, 2))
    file = disc_file(tmp_path, np.column_stack([xy, np.full(200, R)]), "x,y,radius")
    model, state, _ = imported.free_discs(scene_of(file))
    contact_forces(model, state)
    model, left = imported.draw_apart(model, state)
    assert left["overlap_left"] < 2e-3
    cycle.advance(model, state, 0.0, 500)
    assert np.hypot(*(state.x - 0.4).T).max() < 1.5  # a heap of 200 loose discs has a radius of 0.8 m


@pytest.fixture(scope="module")
def window():
    found = packing_of(OBLIQUE, soil_discs())
    return found.packing, build_ring(found.nodes, 0.03)


def test_the_packing_of_a_window_fits_into_its_ring(window, tmp_path):
    packing, ring = window
    scene = build_scene(tables([STATIC], {"file": disc_file(tmp_path, np.column_stack(packing[:2]), "x,y,radius")}))
    assert imported.of_window(scene, ring).xy.tobytes() == packing.xy.tobytes()


@pytest.mark.parametrize(("shift", "why"), [((0.02, 0.0), "overlaps of .* with the ring"), ((0.3, 0.0), "outside the window")])
def test_the_packing_of_another_window_is_refused(window, tmp_path, shift, why):
    packing, ring = window
    rows = np.column_stack([packing.xy + shift, packing.radius])
    scene = build_scene(tables([STATIC], {"file": disc_file(tmp_path, rows, "x,y,radius")}))
    with pytest.raises(SceneError, match=why):
        imported.of_window(scene, ring)
