"""A continuum law is one file: it comes from another distribution, is compiled in and computed through the product."""

import json
import sys
from collections import namedtuple
from types import SimpleNamespace

import pytest

from coupler_protocol.scene.declare import History
from fdm_server.effects import added_laws
from tests.fdm_server.effects.installed_laws import BULK, HARDENING, SHEAR, STRENGTH, install, python, scene_data

RUN = """
import json, sys
import colluvium
from coupler_protocol.scene.reader import build_scene
found = []
for number, data in enumerate(json.loads(sys.argv[2])):
    with colluvium.run(build_scene(data), f"{sys.argv[1]}.{number}") as run:
        frames = [(info.step, run.zones(frame)) for frame, info in enumerate(run.frames)]
        found.append([(step, zones.stress.tolist(), zones["mises_strain"].tolist()) for step, zones in frames])
print(json.dumps(found))
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
SPEED, CAP = 2e-5, 4e5  # of the top [m/step]; pressure at which grains crush [Pa]


def answer(done):
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Where both laws are installed."""
    return install(tmp_path_factory.mktemp("site"))


@pytest.fixture(scope="module")
def runs(folder, tmp_path_factory):
    """Frames (step, stresses, plastic strains of von Mises) of simple shear and of uniaxial compression, compiled and not.

    Both laws are there, each acts in one of the two: there is no pressure in shear, and compression does not reach the strength.
    """
    shear = scene_data(MISES | {"crushing": {"pressure": 1e4}}, (SPEED, 0.0))
    far = {"hardening_mises": {"strength": 1e9, "hardening": HARDENING}}
    compression = scene_data(far | {"crushing": {"pressure": CAP}}, (0.0, -SPEED))
    out, data = tmp_path_factory.mktemp("runs"), json.dumps([shear, compression])
    return [answer(python(["-c", RUN, out / f"run{jit}", data], folder, jit=jit)) for jit in (True, False)]


def test_a_run_with_added_laws_has_the_same_bits_compiled_and_not(runs):
    assert runs[0] == runs[1]


def test_hardening_follows_the_closed_form(runs):
    yielded = []
    for step, stress, strain in runs[0][0]:
        elastic = SHEAR * step * SPEED
        plastic = max(elastic - STRENGTH, 0.0) / (SHEAR + HARDENING)
        yielded.append(plastic > 0.0)
        for (xx, yy, zz, xy), g in zip(stress, strain, strict=True):
            assert xy == pytest.approx(elastic - SHEAR * plastic, rel=1e-12)
            assert g == pytest.approx(plastic, rel=1e-12)
            assert max(map(abs, (xx, yy, zz))) < 1e-6
    assert {True, False} == set(yielded)


def test_crushing_follows_the_closed_form(runs):
    """Mean pressure K e up to the cap, then the cap; the deviator, of differences 2 G e, goes on to grow."""
    crushed = []
    for step, stress, strain in runs[0][1]:
        e = step * SPEED
        pressure, part = min(BULK * e, CAP), 2.0 * SHEAR * e / 3.0
        crushed.append(pressure == CAP)
        for (xx, yy, zz, xy), g in zip(stress, strain, strict=True):
            assert [xx, yy, zz] == pytest.approx([part - pressure, -2.0 * part - pressure, part - pressure], rel=1e-12)
            assert abs(xy) < 1e-6
            assert g == 0.0
    assert {True, False} == set(crushed)


def test_an_edited_law_is_compiled_again(tmp_path):
    folder, data = install(tmp_path / "site"), json.dumps(scene_data(MISES | {"crushing": {"pressure": 1e9}}))
    before = answer(python(["-c", STEP, data], folder))
    law = folder / "hardening_mises.py"
    text = law.read_text(encoding="utf-8")
    assert text.count("left = 1.0 - p.shear * d / size") == 1
    law.write_text(text.replace("left = 1.0 - p.shear * d / size", "left = 0.5 - p.shear * d / size"), encoding="utf-8")
    after = answer(python(["-c", STEP, data], folder))
    assert before[0][3] == pytest.approx(STRENGTH + HARDENING * (SHEAR * 2e-3 - STRENGTH) / (SHEAR + HARDENING), rel=1e-12)
    assert after[0][3] < 0.9 * before[0][3]


def test_a_law_file_that_lacks_its_function_is_refused_by_name(tmp_path):
    folder = install(tmp_path / "site")
    law = folder / "crushing.py"
    law.write_text(law.read_text(encoding="utf-8").replace("def corrected", "def mended"), encoding="utf-8")
    said = python(["-c", CHECK, json.dumps(scene_data({"crushing": {"pressure": 1e4}}))], folder).stdout
    assert "material.crushing" in said
    assert "'someones-laws'" in said
    assert "no function `corrected`" in said
    assert not python(["-c", CHECK, json.dumps(scene_data({}))], folder).stdout


def test_a_law_of_discs_from_another_distribution_is_refused_by_name(tmp_path):
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
    said = python(["-c", CHECK, json.dumps(data)], folder).stdout
    assert "no kernel computes discs.crushing, which distribution 'someones-laws' declares" in said


@pytest.mark.parametrize(
    ("place", "other"),
    [("material.crushing", "others-laws"), ("material.elastic", "colluvium"), ("grain.friction", "colluvium")],
)
def test_two_distributions_with_an_effect_for_the_same_place_are_refused_by_their_names(tmp_path, configs, place, other):
    """Also where the second one would replace an effect of ours; whichever stands first on the path."""
    folder = install(tmp_path / "site", {place: "crushing:Crushing"})
    if other != "colluvium":
        install(folder, {place: "hardening_mises:HardeningMises"}, name=other)
    done = python(["-m", "colluvium.cli", "check", configs / "quick_slope.toml"], folder)
    assert done.returncode == 4, done.stderr
    one, two = sorted(["someones-laws", other])
    assert f"{place} is declared by the installed distributions '{one}' and '{two}'" in done.stderr
    assert "uninstall one of them" in done.stderr


@pytest.mark.parametrize(
    ("name", "recorded", "words"),
    [
        ("mises_strain", "stress", "a recorded field with the name 'stress', which colluvium has"),
        ("plastic_shear", "mises_strain", "a history with the name 'plastic_shear', which colluvium has"),
        ("Mises/strain", "mises_strain", "a history with the name 'Mises/strain': use small letters, digits and _"),
        ("mises_strain", "mises strain", "a recorded field with the name 'mises strain': use small letters"),
    ],
)
def test_names_of_histories_are_checked_like_ours(name, recorded, words, monkeypatch):
    """A field `stress` of a law would replace the stress of the zones in every frame."""
    law = SimpleNamespace(HISTORIES=(History(name, "zone", recorded=recorded),), Parameters=namedtuple("P", "a"))
    law.parameters = law.corrected = print
    effect = type("Mises", (), {"__module__": "laws_of_a_test"})
    monkeypatch.setitem(sys.modules, "laws_of_a_test", law)
    monkeypatch.setattr(added_laws, "declared", lambda: {"mises": effect})
    assert words in added_laws.missing(effect)
    law.HISTORIES = (History("mises_strain", "zone", recorded="mises_strain"),)
    assert added_laws.missing(effect) == ""
    law.HISTORIES = (History("mises_strain", "zone"),)
    other = type("Other", (), {"__module__": "laws_of_another"})
    monkeypatch.setitem(sys.modules, "laws_of_another", SimpleNamespace(HISTORIES=law.HISTORIES))
    monkeypatch.setattr(added_laws, "declared", lambda: {"mises": effect, "other": other})
    assert "'mises_strain', which another law has" in added_laws.missing(effect)


def test_an_entry_point_that_cannot_be_imported_is_a_fault_of_the_environment(tmp_path, configs):
    """By its name and that of its distribution, with exit code 4 instead of a traceback."""
    folder = install(tmp_path / "site", {"material.crushing": "crushing:Crashing", "material.gone": "no_such_module:Law"})
    done = python(["-m", "colluvium.cli", "check", configs / "quick_slope.toml"], folder)
    assert done.returncode == 4, done.stderr
    assert "'material.crushing' (colluvium.effects) of the installed distribution 'someones-laws'" in done.stderr
    assert "cannot be imported" in done.stderr
    assert "uninstall the distribution" in done.stderr
    assert "Traceback" not in done.stderr
