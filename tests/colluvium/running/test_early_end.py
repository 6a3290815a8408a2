"""A side that ends before both have met ends the run at once, whatever the clocks of arrivals are."""

import json

import pytest

from colluvium.running import threads
from coupler_protocol.exits import EnvironmentFailed
from coupler_protocol.scene.reader import read_scene
from tests.commands import command, finished

SCENE = {
    "format": 1,
    "seed": 1,
    "grid": {"kind": "box", "length": 4.0, "height": 4.0, "zone_size": 0.5},
    "material": [{"name": "ground", "density": 2700.0, "elastic": {"bulk": 0.5e9, "shear": 0.15e9}}],
    "boundary": [{"on": "bottom", "fix": "xy"}],
    "damping": {"local": 0.8},
    "window": [{"name": "hole", "columns": [2, 5], "rows": [2, 5]}],
    "discs": {"radius": 0.12, "soil": {"density": 2000.0, "spring": {"normal": 5e7, "shear": 2e7}}},
    "link": {"arrival": 1e6, "give_up": 1e6},
    "stage": [
        {"name": "equilibrium", "gravity": 0.0, "until": {"steps": 5}},
        {"name": "fill"},
        {"name": "couple", "handover": 5, "until": {"steps": 5}},
    ],
}


@pytest.fixture
def scene_path(tmp_path):
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(SCENE))
    return path


@pytest.mark.parametrize(
    "side", ["dem_server.procedure.window_side.DiscreteSide", "fdm_server.procedure.grid_side.ContinuumSide"]
)
def test_in_one_process_nobody_waits_for_a_side_that_has_ended(tmp_path, scene_path, monkeypatch, side):
    def fail(*arguments):
        raise EnvironmentFailed("no memory")

    monkeypatch.setattr(side, fail)
    with pytest.raises(EnvironmentFailed, match="no memory"):
        threads.run(read_scene(scene_path), tmp_path)
    assert json.loads((tmp_path / "run.json").read_text())["exit_code"] == 4


@pytest.mark.long
def test_the_launcher_does_not_wait_for_discs_that_died_before_hello(tmp_path, scene_path):
    """The plugin ends the discrete process before it says HELLO; the grid would wait for days."""
    plugin = tmp_path / "early.py"
    plugin.write_text("import os, sys\nif 'dem_server' in sys.orig_argv: os.kill(os.getpid(), 9)\ndef on_stage(moment): pass\n")
    arguments = command("colluvium.cli", "run", scene_path, "--out", tmp_path / "run", "--plugin", plugin, "--quiet")
    done = finished(arguments, timeout=300)
    assert done.returncode == 5
    assert "dem-server 1 was ended from outside (SIGKILL)" in done.stderr
