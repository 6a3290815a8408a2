"""A continuum law is one file: it comes from another distribution, is compiled in and computed through the product."""

import json

import pytest

from tests.fdm_server.effects.installed_laws import HARDENING, SHEAR, STRENGTH, install, python, scene_data

RUN = """
import json, sys
import colluvium
from coupler_protocol.scene.reader import build_scene
run = colluvium.run(build_scene(json.loads(sys.argv[2])), sys.argv[1])
zones = run.zones(-1)
print(json.dumps([zones.stress.tolist(), zones["mises_strain"].tolist()]))
"""
STEP = """
import json, sys
from coupler_protocol.scene.reader import build_scene
from fdm_server.mesh.grid import build_grid
from fdm_server.model import build_model, new_state
from fdm_server.observe import fields
from fdm_server.step.zone_pass import advance
scene = build_scene(json.loads(sys.argv[1]))
model = build_model(scene, build_grid(scene))
state = new_state(model)
state.velocity[:, 0] = 2e-5 * model.grid.xy[:, 1]
for _ in range(100):
    advance(model, state)
print(json.dumps(fields.stress(model, state).tolist()))
"""
CHECK = """
import json, sys
from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import build_scene
try:
    build_scene(json.loads(sys.argv[1]))
except SceneError as error:
    print(error)
"""
MISES = {"hardening_mises": {"strength": STRENGTH, "hardening": HARDENING}}


def answer(done):
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp("cache")


def test_a_run_with_a_law_of_its_own_follows_the_closed_form_compiled_and_not(tmp_path, cache):
    folder, data = install(tmp_path / "site"), json.dumps(scene_data(MISES | {"crushing": {"pressure": 1e4}}))
    found = [answer(python(RUN, folder, cache, tmp_path / f"run{jit}", data, jit=jit)) for jit in (True, False)]
    angle = 100 * 2e-5
    plastic = (SHEAR * angle - STRENGTH) / (SHEAR + HARDENING)
    for stress, strain in found:
        for (xx, yy, zz, xy), g in zip(stress, strain, strict=True):
            assert xy == pytest.approx(STRENGTH + HARDENING * plastic, rel=1e-12)
            assert g == pytest.approx(plastic, rel=1e-12)
            assert max(map(abs, (xx, yy, zz))) < 1e-6
    assert found[0] == found[1]


def test_an_edited_law_is_compiled_again(tmp_path, cache):
    folder, data = install(tmp_path / "site"), json.dumps(scene_data(MISES))
    before = answer(python(STEP, folder, cache, data))
    law = folder / "hardening_mises.py"
    text = law.read_text(encoding="utf-8")
    assert text.count("left = 1.0 - p.shear * d / size") == 1
    law.write_text(text.replace("left = 1.0 - p.shear * d / size", "left = 0.5 - p.shear * d / size"), encoding="utf-8")
    after = answer(python(STEP, folder, cache, data))
    assert before[0][3] == pytest.approx(STRENGTH + HARDENING * (SHEAR * 2e-3 - STRENGTH) / (SHEAR + HARDENING), rel=1e-12)
    assert after[0][3] < 0.9 * before[0][3]


def test_a_law_file_that_lacks_its_function_is_refused_by_name(tmp_path, cache):
    folder = install(tmp_path / "site")
    law = folder / "crushing.py"
    law.write_text(law.read_text(encoding="utf-8").replace("def corrected", "def mended"), encoding="utf-8")
    said = python(CHECK, folder, cache, json.dumps(scene_data({"crushing": {"pressure": 1e4}}))).stdout
    assert "material.crushing" in said
    assert "'someones-laws'" in said
    assert "no function `corrected`" in said
    assert not python(CHECK, folder, cache, json.dumps(scene_data({}))).stdout


def test_a_law_of_discs_from_another_distribution_is_refused_by_name(tmp_path, cache):
    folder = install(tmp_path / "site", {"discs.crushing": "crushing:Crushing"})
    data = {
        "format": 1, "seed": 1,
        "window": [{"name": "w", "polygon": [[0, 0], [4, 0], [4, 4], [0, 4]]}],
        "discs": {
            "radius": 0.1, "porosity": 0.16, "soil": {"density": 2000.0, "spring": {"normal": 1e8, "shear": 1e8}},
            "crushing": {"pressure": 1e4},
        },
        "stage": [{"name": "fill", "kind": "fill"}],
    }  # fmt: skip
    said = python(CHECK, folder, cache, json.dumps(data)).stdout
    assert "no kernel computes discs.crushing, which distribution 'someones-laws' declares" in said
