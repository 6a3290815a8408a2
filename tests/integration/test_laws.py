"""Softening, damping and real time through whole runs: going on from a stage's end, and a blow-up that is stopped and saved."""

import json
import tomllib

import numpy as np
import pytest

import colluvium
from coupler_protocol import exits
from coupler_protocol.scene.reader import build_scene
from tests.commands import run_colluvium

SOFT = {"strain": [1e-5, 1e-3], "cohesion": [2e3, 0.0], "friction": [20.0, 15.0], "tension": [0.0, 0.0]}


@pytest.fixture
def scene_data(configs):
    """The quick slope without discs, weak and softening, in a static stage and two in real time."""
    data = tomllib.loads((configs / "quick_slope.toml").read_text(encoding="utf-8"))
    del data["window"], data["discs"]
    data["material"][0] |= {"softening": SOFT, "mohr_coulomb": {"friction": 25.0, "cohesion": 8e3}}
    data["record"] = {"every": 50, "history": 10}
    real = {"kind": "overload", "time": "real", "damping": {"combined": 0.4}, "until": {"time": 0.03}}
    data["stage"] = [
        {"name": "equilibrium", "gravity": 9.81, "until": {"steps": 150}},
        {"name": "shaken"} | real | {"gravity_factor": 2.0},
        {"name": "later"} | real | {"large_strain": True, "until": {"time": 0.02}},
    ]
    return data


@pytest.mark.long
def test_going_on_in_real_time_gives_the_bits_of_the_straight_run(scene_data, tmp_path):
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(scene_data), encoding="utf-8")
    for words in (["--out", tmp_path / "one"], ["--out", tmp_path / "two", "--from", f"{tmp_path / 'one'}@shaken"]):
        done = run_colluvium("run", path, "--in-process", "--quiet", *words)
        assert done.returncode == 0, done.stderr
    with colluvium.open_run(tmp_path / "one") as one, colluvium.open_run(tmp_path / "two") as two:
        a, b = one.zones(-1), two.zones(-1)
        assert one.frames[-1] == two.frames[-1]
        assert np.array_equal(a.stress, b.stress)
        assert np.array_equal(a.plastic_shear_strain, b.plastic_shear_strain)
        assert a.plastic_shear_strain.max() > 1e-5
        assert np.array_equal(one.gridpoints(-1).velocity, two.gridpoints(-1).velocity)


def test_a_blow_up_stops_the_run_and_saves_the_state(scene_data, tmp_path):
    """Masses that a user's function makes too light for the step."""
    scene_data["stage"] = scene_data["stage"][:1]

    def lighten(moment):
        if moment.step == 50:
            moment.model.mass[:] *= 0.12

    with pytest.raises(exits.PhysicsFailed, match=r"grows by itself\. The fastest gridpoint is at .*, in zone \d+"):
        colluvium.run(build_scene(scene_data), tmp_path / "out", on_step=(10, lighten))
    assert (tmp_path / "out" / "fdm.rank0.stopped.h5").is_file()
    about = json.loads((tmp_path / "out" / "run.json").read_text(encoding="utf-8"))
    assert about["exit_code"] == exits.PHYSICS
