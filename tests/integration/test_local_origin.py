"""Discs far from the origin: the run of the scene at the origin, in all files at the coordinates of the scene."""

import json

import h5py
import numpy as np
import pytest
from verification.discrete.scenes import SOIL

from colluvium.results import export
from colluvium.results.run import open_run
from colluvium.running.threads import run
from coupler_protocol.files import disc_csv
from coupler_protocol.files.restart import Origin
from coupler_protocol.scene.local_origin import local_origin
from coupler_protocol.scene.reader import build_scene

UTM = (412345.0, 5512345.0)
STONES = [[0.2, 0.2], [0.7, 0.25], [0.6, 0.7], [0.25, 0.6]]


def scene_at(x, y, path=None, **discs):
    """A block of discs with a stone between three walls, its corner at (x, y)."""

    def at(*points):
        return [[round(px + x, 6), round(py + y, 6)] for px, py in points]

    walls = [at((-1, 0.05), (2, 0.05)), at((0.05, -1), (0.05, 2)), at((0.95, 2), (0.95, -1))]
    data = {
        "format": 1,
        "seed": 3,
        "record": {"every": 100, "history": 20},
        "discs": {"radius": 0.05, "confinement": 5e3, "damping": {"local": 0.7}, "soil": SOIL} | discs,
        "stage": [
            {"name": "fill"},
            {"name": "rest", "kind": "discs", "gravity": 9.81, "until": {"steps": 200}},
            {"name": "more", "kind": "discs", "until": {"steps": 100}},
        ],
    }
    data["discs"]["wall"] = [{"ends": ends} for ends in walls]
    if "file" not in discs:
        data["window"] = [{"name": "block", "polygon": at((0, 0), (1, 0), (1, 1), (0, 1))}]
    if path is not None:
        table = "".join(f"a,{px!r},{py!r}\n" for px, py in at(*STONES))
        path.write_text("stone,x,y\n" + table, encoding="utf-8")
        data["stones"] = {"file": str(path), "body": "clump"}
        data["discs"]["stone"] = SOIL
    return data


def computed(data, out, origin=None):
    out.mkdir(exist_ok=True)
    run(build_scene(data), out, origin=origin)
    return out


def positions(out):
    """Places (frames, n, 2) of all discs in all frames."""
    with open_run(out) as found:
        return np.array([found.discs(k).xy for k in range(len(found.frames))])


def test_a_pile_at_utm_coordinates_is_that_at_the_origin(tmp_path):
    near, far = computed(scene_at(0.0, 0.0), tmp_path / "near"), computed(scene_at(*UTM), tmp_path / "far")
    np.testing.assert_allclose(positions(far) - UTM, positions(near), atol=1e-8)
    with open_run(near) as a, open_run(far) as b:
        assert np.array_equal(a.history("unbalanced_ratio")[1], b.history("unbalanced_ratio")[1])
        assert b.history("wall_x:1")[1][-1] == UTM[0] + 0.5
        assert b.history("wall_y:1")[1][-1] == UTM[1] + 0.05
    report = json.loads((far / "run.json").read_text(encoding="utf-8"))["windows"][0]
    assert report["computed_about"] == list(UTM)
    assert "computed_about" not in json.loads((near / "run.json").read_text(encoding="utf-8"))["windows"][0]


def test_stones_of_a_map_lie_where_it_says(tmp_path):
    """A map's corners have a round-off of 1e-9 m there, which the stones' weights have from them."""
    near = computed(scene_at(0.0, 0.0, tmp_path / "near.csv"), tmp_path / "near")
    far = computed(scene_at(*UTM, tmp_path / "far.csv"), tmp_path / "far")
    np.testing.assert_allclose(positions(far)[0] - UTM, positions(near)[0], atol=1e-7)
    np.testing.assert_allclose(positions(far)[-1] - UTM, positions(near)[-1], atol=0.02)
    with h5py.File(far / "dem.rank1.vtkhdf", "r") as file:
        corners = next(file[name] for name in _names(file) if name.endswith("stone_corners"))[:]
    assert np.abs(corners[:, :2] - UTM).max() < 1.0


def _names(file):
    found = []
    file.visit(found.append)
    return found


def test_a_run_far_away_goes_on_with_the_same_bits(tmp_path):
    whole = computed(scene_at(*UTM), tmp_path / "whole")
    branch = computed(scene_at(*UTM), tmp_path / "branch", origin=Origin(whole, "rest"))
    assert np.array_equal(positions(whole)[-1], positions(branch)[-1])


def test_discs_of_a_file_keep_their_places(tmp_path):
    """Exported where they came to rest and read again, they rest on: gaps are differences of places near each other."""
    done = computed(scene_at(*UTM), tmp_path / "done")
    export.write(done, None, None, 1, tmp_path / "discs.csv")
    found = disc_csv.read(tmp_path / "discs.csv")
    np.testing.assert_allclose(found.xy, positions(done)[-1], rtol=0, atol=0)
    scene = build_scene(scene_at(*UTM, file=str(tmp_path / "discs.csv")))
    assert local_origin(scene, found.xy).tolist() == pytest.approx(UTM, abs=1.0)
    again = computed(scene_at(*UTM, file=str(tmp_path / "discs.csv")), tmp_path / "again")
    np.testing.assert_allclose(positions(again)[-1], found.xy, atol=1e-4)


def test_scenes_near_the_origin_are_computed_as_they_are(configs):
    for corner in ((0.0, 0.0), (30.0, -20.0), (900.0, 0.0)):
        assert local_origin(build_scene(scene_at(*corner))).tolist() == [0.0, 0.0]
    assert local_origin(build_scene(scene_at(1200.5, 0.0))).tolist() == [1200.0, 0.0]
