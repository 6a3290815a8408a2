"""Grids anywhere: the bits of the scene at the origin, and the coordinates of the scene in all that a run leaves."""

import copy
import json

import numpy as np
import pytest

from colluvium.forecast import check
from colluvium.results import averages, window_fields
from colluvium.results.run import open_run
from colluvium.running.threads import run
from coupler_protocol.files.restart import Origin
from coupler_protocol.problems import SceneError
from coupler_protocol.process.plugin import from_functions
from coupler_protocol.scene.local_origin import local
from coupler_protocol.scene.reader import build_scene
from fdm_server.fos.study import Study
from fdm_server.mesh.grid import build_grid
from tests.integration.drawn_slopes import GROUND, slope_with_a_window
from tests.same_bits import differing

UTM = (412345.0, 5300000.0)


def computed(data, out, origin=None, plugin=None):
    out.mkdir(exist_ok=True)
    run(build_scene(data), out, origin=origin, plugin=plugin)
    return out


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """The same slope at the origin and at UTM coordinates; and the origins that its functions were told."""
    folder, told = tmp_path_factory.mktemp("runs"), set()
    plugin = from_functions(on_stage=lambda moment: told.add((moment.rank, moment.origin)))
    near, far = (
        computed(slope_with_a_window(), folder / "near"),
        computed(slope_with_a_window(*UTM), folder / "far", plugin=plugin),
    )
    return near, far, told


def test_bits_are_those_at_the_origin_and_places_those_of_the_scene(runs):
    near, far, told = runs
    for name in ("fdm.rank0", "dem.rank1"):
        assert differing(near / f"{name}.vtkhdf", far / f"{name}.vtkhdf") == ["VTKHDF/Points"]
        assert differing(near / f"{name}.couple.h5", far / f"{name}.couple.h5") == []
    with open_run(near) as a, open_run(far) as b:
        for k in range(len(a.frames)):
            np.testing.assert_allclose(b.gridpoints(k).xy - UTM, a.gridpoints(k).xy, atol=1e-9)
            if a.has(k, 1):
                np.testing.assert_allclose(b.discs(k).xy - UTM, a.discs(k).xy, atol=1e-9)
    assert told == {(0, UTM), (1, UTM)}


def test_what_a_run_says_has_the_coordinates_of_the_scene(runs):
    near, far, _ = runs
    a, b = (json.loads((out / "run.json").read_text(encoding="utf-8")) for out in (near, far))
    assert "computed_about" not in a
    assert b["computed_about"] == list(UTM)
    (*_, couple), (*_, there) = a["stages"], b["stages"]
    for name, limit in couple["limits"].items():
        np.testing.assert_allclose(np.subtract(there["limits"][name]["at"], UTM), limit["at"], atol=1e-8)
    np.testing.assert_allclose(
        np.subtract(b["windows"][0]["limits"][0]["at"], UTM), a["windows"][0]["limits"][0]["at"], atol=1e-8
    )
    scene = json.loads((far / "scene.json").read_text(encoding="utf-8"))
    assert scene["grid"]["profile"][0] == [412345.0, 5300004.0]
    assert scene["grid"]["origin"] is None
    with open_run(near) as first, open_run(far) as second:
        last = len(first.frames) - 1
        values = []
        for found, (x, y) in ((first, (0.0, 0.0)), (second, UTM)):
            discs, contacts, circle = found.discs(last), found.contacts(last), (6.0 + x, 3.2 + y, 0.8)
            box = [[5.0 + x, 2.5 + y], [7.0 + x, 2.5 + y], [7.0 + x, 4.0 + y], [5.0 + x, 4.0 + y]]
            mean = window_fields.mean_stress(found, last, window_fields.bins(found, last))
            regions = [value for region in (circle, box) for value in averages.average_stress(discs, contacts, region)]
            porosities = [1e5 * averages.porosity(discs, region) for region in (circle, box)]
            values.append(np.concatenate([regions, porosities, np.nan_to_num(mean).ravel()]))
        np.testing.assert_allclose(values[1], values[0], rtol=1e-6, atol=0.1)


def test_a_run_far_away_goes_on_with_the_same_bits(runs, tmp_path):
    _, far, _ = runs
    branch = computed(slope_with_a_window(*UTM), tmp_path / "branch", origin=Origin(far, "fill"))
    for name in ("fdm.rank0", "dem.rank1"):
        assert differing(far / f"{name}.couple.h5", branch / f"{name}.couple.h5") == []


def test_check_names_the_point_and_the_scene_keeps_its_numbers():
    near, far = build_scene(slope_with_a_window()), build_scene(slope_with_a_window(*UTM))
    assert local(near) is near
    here = local(far)
    assert local(here) is here
    assert here.origin == UTM
    assert here.digest() == far.digest() == build_scene(far.resolved()).digest()
    assert here.window[0].polygon == near.window[0].polygon
    assert here.stage[2].surcharge.x == near.stage[2].surcharge.x
    a, b = check.describe(near), check.describe(far)
    assert b["begins"] == list(UTM)
    assert {**a, "hash": ""} == {key: value for key, value in b.items() if key not in ("begins", "hash", "stages")} | {
        "hash": "",
        "stages": a["stages"],
    }
    assert next(check.opening(far)) == "the grid begins at x = 412345, y = 5300000 m, about which the scene is computed"


@pytest.mark.parametrize(
    ("grid", "origin"),
    [
        ({"profile": [[0.0, 4.0], [10.0, 8.0]]}, (0.0, 0.0)),
        (
            {"profile": [[412345.0, 4.0], [412355.0, 8.0]]},
            (412345.0, 0.0),
        ),  # a distance along a line, and heights above the bottom
        ({"profile": [[412345.0, 424.0], [412355.0, 428.0]]}, (412345.0, 420.0)),  # heights above the sea
        ({"profile": [[0.0, -6.0], [10.0, -2.0]]}, (0.0, -10.0)),  # below the sea
        ({"profile": [[0.0, 424.0], [10.0, 428.0]], "origin": [0.0, 420.0]}, (0.0, 420.0)),
        ({"profile": [[-5.0, 4.0], [5.0, 8.0]]}, (-5.0, 0.0)),
        ({"kind": "box", "origin": [412345.25, -3.5]}, (412345.25, -3.5)),
    ],
)
def test_where_a_grid_begins(grid, origin):
    data = slope_with_a_window() | {"window": [], "boundary": [{"on": "bottom", "fix": "xy"}]}
    data |= {"material": [{"name": "soil"} | GROUND], "stage": data["stage"][:1]}
    del data["discs"], data["initial_stress"]
    data["grid"] = {"length": 10.0, "height": 8.0, "zone_size": 1.0} | grid
    if data["grid"].get("kind") != "box":
        data["grid"]["fit"] = "profile"
    scene = build_scene(data)
    mesh = build_grid(local(scene))
    assert local(scene).origin == mesh.origin == origin
    assert mesh.xy.min(axis=0).tolist() == [0.0, 0.0]


def test_a_ring_has_its_hole_at_its_origin():
    data = slope_with_a_window() | {"window": [], "boundary": [{"on": "outer", "fix": "xy"}]}
    data |= {"material": [{"name": "soil"} | GROUND], "stage": data["stage"][:1]}
    del data["discs"], data["initial_stress"]
    data["grid"] = {"kind": "ring", "inner": 1.0, "outer": 4.0, "around": 12, "origin": list(UTM)}
    assert local(build_scene(data)).origin == UTM


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda data: data["stage"][2]["surcharge"].update(x=[412300.0, 412350.0]), r"\[412300, 412350\] is not on the ground"),
        (
            lambda data: data["boundary"][3].update(x=[412300.0, 412310.0]),
            r"from x = 412345 to 412357 .* y = 5300004 to 5300007.5 m",
        ),
        (lambda data: data["window"][0].update(polygon=[[1, 1], [2, 1], [2, 2]]), "contains no zones"),
        (
            lambda data: data["material"][2].update(region=[[1, 1], [2, 1], [2, 2]]),
            "the ground is x 412345 to 412357, y 5300000 to",
        ),
        (
            lambda data: data["window"][0]["polygon"].insert(1, [412351.0, 5300008.0]),
            r"crosses or touches itself at \(4123",
        ),
        (lambda data: data["grid"].update(length=13.0), "it runs from 412345 to 412357 m"),
    ],
)
def test_refusals_have_the_coordinates_of_the_scene(change, words):
    data = copy.deepcopy(slope_with_a_window(*UTM))
    change(data)
    with pytest.raises(SceneError, match=words):
        build_scene(data)


def test_a_factor_of_safety_is_that_at_the_origin(tmp_path):
    found = []
    for place in ((0.0, 0.0), UTM):
        data = slope_with_a_window(*place) | {"window": [], "fos": {"resolution": 0.2, "ratio": 1e-4, "steps": 6000}}
        data["stage"] = [data["stage"][0]]
        del data["discs"]
        for soil in data["material"]:
            soil["mohr_coulomb"] = {"friction": 20.0, "cohesion": 4e3}
        out = tmp_path / str(len(found))
        out.mkdir()
        study = Study(build_scene(data), out, lambda *a, **k: None, lambda: None)
        study.stop = type("Never", (), {"check": staticmethod(lambda: None)})
        found.append(study.run())
    assert found[0]["doubts"] == found[1]["doubts"]
    (doubt,) = found[1]["doubts"]
    assert doubt["key"] == "stage[0].until"
    (a,), (b,) = found[0]["meshes"], found[1]["meshes"]
    assert (a["low"], a["high"]) == (b["low"], b["high"])
    assert differing(tmp_path / "0" / "mesh1" / "fdm.rank0.vtkhdf", tmp_path / "1" / "mesh1" / "fdm.rank0.vtkhdf") == [
        "VTKHDF/Points"
    ]
