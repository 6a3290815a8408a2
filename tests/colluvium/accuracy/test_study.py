"""Settings of a study: which search gives a factor, and failures that are values."""

import pytest

from colluvium.accuracy import study as module
from colluvium.accuracy.knobs import Setting
from colluvium.accuracy.quantity import quantity_of
from colluvium.accuracy.study import Study
from coupler_protocol import exits
from coupler_protocol.files import run_json
from coupler_protocol.scene.reader import read_scene

PLAIN = Setting({}, ())


def study_of(configs, name, quantity, out):
    path = str(configs / name)
    return Study(path, [], quantity_of(quantity, read_scene(path)), out, lambda text: None)


def test_the_factor_of_a_coupled_scene_is_that_of_grid_and_discs(configs, tmp_path, monkeypatch):
    def searched(scene, out, asked):
        trials = {"trials": [{"steps": 100}], "seconds": 2.0, "zone_size": 1.0}
        mesh = {"value": 1.5, "low": 1.4, "high": 1.6} | trials
        found = {"quantity": "factor of safety", "meshes": [mesh], "coupled": {"value": 1.3, "low": 1.28, "high": 1.32} | trials}
        run_json.write_json(out / "fos.json", found)
        return exits.DONE

    monkeypatch.setattr(module.searches, "run", searched)
    monkeypatch.setattr(module.processes, "run_alone", lambda *_, **__: pytest.fail("the grid alone"))
    found = study_of(configs, "quick_slope.toml", "fos", tmp_path).result(PLAIN, True)
    assert (found.value, found.half_width) == (1.3, pytest.approx(0.02))
    assert (found.steps, found.seconds) == (200, 4.0)


def test_the_factor_of_a_grid_alone_is_searched_there(configs, tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(module.searches, "run", lambda *_: pytest.fail("a coupled search"))
    monkeypatch.setattr(module.processes, "run_alone", lambda name, words, **_: asked.append(name) or exits.PHYSICS)
    found = study_of(configs, "griffiths_lane.toml", "fos", tmp_path).result(PLAIN, True)
    assert asked == ["fdm_server.fos"]
    assert "exit code 6" in found.failed


@pytest.mark.parametrize(("quantity", "fails"), [("failure_gravity", False), ("fabric_a", True)])
def test_a_run_that_fails_after_its_slope_has_a_failure_gravity(configs, tmp_path, monkeypatch, quantity, fails):
    monkeypatch.setattr(module.processes, "run_files", lambda *_, **__: exits.PHYSICS)
    monkeypatch.setattr(module, "value_of", lambda *_: (7.5, 0.1))
    monkeypatch.setattr(module, "_cost", lambda *_: {"steps": 10, "seconds": 1.0})
    found = study_of(configs, "quick_slope.toml", quantity, tmp_path).result(PLAIN, True)
    assert (found.value is None, bool(found.failed)) == (fails, fails)
