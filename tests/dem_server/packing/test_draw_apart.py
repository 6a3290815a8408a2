"""Discs of a file that overlap: refused before real time, drawn apart before static stages, never no number."""

import numpy as np
import pytest
from verification.discrete.scenes import disc_file, tables

from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import build_scene
from dem_server.packing import draw_apart, packing_from_file
from dem_server.step import cycle
from dem_server.step.contact_pass import contact_forces
from dem_server.step.walls import make_walls

R = 0.05
STATIC = {"name": "rest", "kind": "discs", "damping": {"local": 0.7}, "until": {"ratio": 1e-6, "steps": 20000}}
REAL = {"name": "go", "kind": "discs", "time": "real", "until": {"time": 0.001}}


def scene_of(file, stage=STATIC, **discs):
    return build_scene(tables([stage], {"file": file} | discs))


def test_overlaps_are_refused_in_real_time_and_calm_in_static_mode(tmp_path):
    """An overlap d of .8 of the radius stores kn d^2 / 2; before a static stage the two are drawn apart and stay there."""
    file = disc_file(tmp_path, [[0.0, 0.0, R], [0.96, 1.0, R], [1.2 * 0.6 * R, 1.2 * 0.8 * R, R]], "x,y,radius")
    with pytest.raises(SceneError, match=r"discs 1 and 3 overlap by 0.8 of the smaller radius, 1 pairs") as refused:
        packing_from_file.free_discs(scene_of(file, REAL))
    assert "static stage" in str(refused.value)
    model, state, report = packing_from_file.free_discs(scene_of(file))
    assert report["overlap_energy"] == pytest.approx(0.5 * 2.5e7 * (0.8 * R) ** 2, rel=1e-12)
    assert report["largest_overlap"] == pytest.approx(0.8, rel=1e-12)
    start = state.x.copy()
    contact_forces(model, state)
    model, left = draw_apart.separate_discs(model, state)
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
    model, state, _ = packing_from_file.free_discs(scene_of(file))
    state.walls = make_walls([[-0.5 * R, -1.0, -0.5 * R, 1.0], [3.5 * R, -1.0, 3.5 * R, 1.0]], np.zeros((2, 2)), model)
    contact_forces(model, state)
    model, left = draw_apart.separate_discs(model, state)
    assert left["overlap_left"] == pytest.approx(0.5, rel=0.02)
    np.testing.assert_allclose(state.walls.force[:, 0], [-1.25e7 * R, 1.25e7 * R], rtol=0.02)


def test_two_discs_in_one_place_are_refused(tmp_path):
    file = disc_file(tmp_path, [[0.0, 0.0, R], [1.0, 0.0, R], [1.0, 0.0, 0.5 * R]], "x,y,radius")
    with pytest.raises(SceneError, match="discs 2 and 3 are in the same place"):
        packing_from_file.free_discs(scene_of(file))


def test_a_disc_on_a_wall_is_refused(tmp_path):
    with pytest.raises(SceneError, match="disc 1 lies on wall 1"):
        scene_of(disc_file(tmp_path, [[0.5, 0.5, R]], "x,y,radius"), wall=[{"ends": [[0.0, 0.0], [1.0, 1.0]]}])


def test_a_heap_of_strong_overlaps_comes_to_rest(tmp_path):
    """200 discs at random in a square that holds 60: they part without one of them shooting off."""
    xy = np.random.default_rng(3).uniform(0.0, 0.8, (200, 2))
    file = disc_file(tmp_path, np.column_stack([xy, np.full(200, R)]), "x,y,radius")
    model, state, _ = packing_from_file.free_discs(scene_of(file))
    contact_forces(model, state)
    model, left = draw_apart.separate_discs(model, state)
    assert left["overlap_left"] < 2e-3
    cycle.advance(model, state, 0.0, 500)
    assert np.hypot(*(state.x - 0.4).T).max() < 1.5  # a heap of 200 loose discs has a radius of 0.8 m
