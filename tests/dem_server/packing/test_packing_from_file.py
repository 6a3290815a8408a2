"""Discs from files: what is refused and in which words, stones without polygons, the packing of a window."""

import numpy as np
import pytest
from verification.discrete.scenes import disc_file, tables
from window_case import OBLIQUE, packing_of, soil_discs

from coupler_protocol.files import disc_csv as files
from coupler_protocol.interface.ring import build_ring
from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import build_scene
from dem_server.effects import STONE
from dem_server.effects.bond import BONDED
from dem_server.packing import draw_apart, packing_from_file

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
        (["x,y,radius", "0,0,1", "1,zero,1", "2,0,-1", "3,0"], ["csv:3", "'zero' is not a number", "csv:4", "positive", "csv:5"]),
        (["x,y,radius,material", "0,0,1,clay"], ["material 'clay' is not known"]),
        (["x,y,radius,material,stone", "0,0,1,stone,-1"], ["disc 1 is of material stone and has stone -1"]),
        (["x,y,radius,stone", "0,0,1,1.5"], ["'1.5' is not an integer"]),
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
    model, state, _ = packing_from_file.free_discs(scene_of(written(tmp_path, lines), stone=ROCK))
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
    _, state, _ = packing_from_file.free_discs(scene_of(written(tmp_path, lines), REAL, stone=ROCK))
    np.testing.assert_allclose(state.clumps.motion[0, 2:5], [1.0, 2.0, spin], rtol=1e-6)


def test_the_weight_of_a_stone_acts_at_its_centroid(tmp_path):
    """Three discs of different sizes, two of which overlap: else the stone would turn under its own weight."""
    rows = [[0.0, 0.0, R], [0.8 * R, 0.3 * R, 0.7 * R], [1.5 * R, 1.4 * R, 0.6 * R]]
    lines = ["x,y,radius,stone", *(",".join(map(repr, row)) + ",0" for row in rows)]
    _, state, _ = packing_from_file.free_discs(scene_of(written(tmp_path, lines), stone=ROCK))
    centroid, by_areas = state.clumps.motion[0, :2], state.radius**2 @ state.x / (state.radius**2).sum()
    np.testing.assert_allclose(state.weight @ state.x / state.weight.sum(), centroid, atol=1e-9 * R)
    assert abs(centroid - by_areas).max() > 0.01 * R


@pytest.mark.parametrize(("change", "why"), [({"spring": None}, "no stiffness"), ({"bond": None}, "nothing holds the discs")])
def test_stones_of_a_file_need_laws(tmp_path, change, why):
    grain = {key: table for key, table in (ROCK | change).items() if table is not None}
    with pytest.raises(SceneError, match=why):
        scene_of(str(tmp_path / "discs.csv"), stone=grain, body="cluster")


def test_a_cluster_is_bonded(tmp_path):
    lines = ["x,y,radius,stone", *(f"{x!r},0.0,{R!r},0" for x in (0.0, 2.0 * R, 4.001 * R))]
    _, state, _ = packing_from_file.free_discs(scene_of(written(tmp_path, lines), stone=ROCK, body="cluster"))
    assert (state.bond_state == 1).sum() == 2
    assert np.abs(state.force).max() < 1e-6 * 5e8 * R  # the one that stood apart is held where it is


def test_stones_need_a_material(tmp_path):
    with pytest.raises(SceneError, match="no material"):
        packing_from_file.free_discs(scene_of(written(tmp_path, ["x,y,radius,stone", "0,0,1,0"])))


@pytest.fixture(scope="module")
def window():
    found = packing_of(OBLIQUE, soil_discs())
    return found.packing, build_ring(found.nodes, 0.03)


def test_the_packing_of_a_window_fits_into_its_ring(window, tmp_path):
    packing, ring = window
    scene = build_scene(tables([STATIC], {"file": disc_file(tmp_path, np.column_stack(packing[:2]), "x,y,radius")}))
    assert packing_from_file.of_window(scene, ring).xy.tobytes() == packing.xy.tobytes()


@pytest.mark.parametrize(("shift", "why"), [((0.02, 0.0), "overlaps of .* with the ring"), ((0.3, 0.0), "outside the window")])
def test_the_packing_of_another_window_is_refused(window, tmp_path, shift, why):
    packing, ring = window
    rows = np.column_stack([packing.xy + shift, packing.radius])
    scene = build_scene(tables([STATIC], {"file": disc_file(tmp_path, rows, "x,y,radius")}))
    with pytest.raises(SceneError, match=why):
        packing_from_file.of_window(scene, ring)


def test_a_window_full_of_overlaps_is_refused(window, tmp_path):
    packing, ring = window
    rows = np.column_stack([packing.xy, np.where(np.arange(len(packing.radius)) % 9 == 0, 1.4, 1.0) * packing.radius])
    middle = np.hypot(*(packing.xy - packing.xy.mean(axis=0)).T) < 0.4
    scene = build_scene(tables([STATIC], {"file": disc_file(tmp_path, rows[middle], "x,y,radius")}))
    with pytest.raises(SceneError, match=r"pairs of discs overlap by more than 0.2 .* the worst by 0\.[3-7]"):
        packing_from_file.of_window(scene, ring)


def test_a_bonded_stone_keeps_the_shape_it_came_in(tmp_path):
    """Two discs that overlap by half, and a third a little apart: nothing is drawn apart, no contact carries a force."""
    lines = ["x,y,radius,stone", "0,0,0.05,0", "0.04,0.03,0.05,0", "0.145,0.03,0.05,0", "0.5,0,0.05,-1"]
    scene = scene_of(written(tmp_path, lines), stone=ROCK, body="cluster")
    model, state, _ = packing_from_file.free_discs(scene)
    before = state.x.copy()
    model, told = draw_apart.separate_discs(model, state)
    assert told == {}
    np.testing.assert_array_equal(state.x, before)
    assert (state.bond_state == BONDED).sum() == 2
    assert np.abs(state.force).max() == 0.0
