"""Ways into `colluvium.run`: a Scene, its tables, a file; values of a copy are checked as those of a file are."""

import tomllib

import pytest

import colluvium
from coupler_protocol.problems import SceneError
from tests.same_bits import differing

BOX = """
format = 1
seed = 1
grid = { kind = "box", length = 1.0, height = 1.0, zone_size = 0.5 }
material = [{ name = "m", density = 2000.0, elastic = { bulk = 5e7, shear = 2e7 } }]
boundary = [{ on = "bottom", fix = "xy" }]
damping = { local = 0.8 }
stage = [{ name = "rest", kind = "equilibrium", gravity = 9.81, until = { steps = 30 } }]
record = { every = 10 }
"""


def test_tables_and_files_are_run_as_their_scene_is(tmp_path):
    path, tables = tmp_path / "box.toml", tomllib.loads(BOX)
    path.write_text(BOX, encoding="utf-8")
    ways = {"scene": colluvium.Scene(**tables), "tables": tables, "path": path, "text": str(path)}
    for name, scene in ways.items():
        colluvium.run(scene, tmp_path / name).close()
        assert differing(tmp_path / "scene" / "fdm.rank0.vtkhdf", tmp_path / name / "fdm.rank0.vtkhdf") == []


@pytest.mark.parametrize("change", [{"seed": "x"}, {"grid": {"kind": "box"}}, {"stage": []}, {"damping": {"local": 7.0}}])
def test_a_copy_with_wrong_values_is_refused_before_anything_is_written(tmp_path, change):
    scene = colluvium.Scene(**tomllib.loads(BOX)).model_copy(update=change)
    with pytest.raises(SceneError):
        colluvium.run(scene, tmp_path / "run")
    assert not (tmp_path / "run").exists()
