"""Quantities measured in frames: mean stress of a region, fabric, failure gravity, error of the energies."""

from types import SimpleNamespace

import numpy as np
import pytest

from colluvium import api
from colluvium.accuracy import measured
from colluvium.accuracy.command import closed_form
from colluvium.accuracy.quantity import quantity_of, value_of
from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import build_scene
from tests.small_grounds import REST, TABLES

SIDES = [{"on": side, "fix": fix} for side, fix in (("bottom", "xy"), ("left", "x"), ("right", "x"))]
START = {"name": "start", "kind": "equilibrium", "gravity": 0.0, "until": {"steps": 1}}


@pytest.fixture(scope="module")
def scene():
    return build_scene(TABLES | {"boundary": SIDES, "record": {"energy": True}, "stage": [START, REST | {"kind": "load"}]})


@pytest.fixture(scope="module")
def folder(scene, tmp_path_factory):
    out = tmp_path_factory.mktemp("column")
    api.run(scene, out, in_process=True)
    return out


def test_the_mean_stress_of_a_polygon_of_zones_is_that_of_its_middle(scene, folder):
    """Ground under its weight: stress_yy = -rho g (H - y) is linear, so its mean is its value at the centroid."""
    value, half = value_of(quantity_of("stress_yy(0, 1, 4, 1, 4, 3, 0, 3)", scene), folder)
    assert (value, half) == (pytest.approx(-2000.0 * 9.81 * 2.0, rel=1e-3), 0.0)


def test_energy_that_is_conserved_is_the_reference_of_its_error(scene):
    asked = SimpleNamespace(reference=None, source="", of="energy.error", set=[])
    assert closed_form(asked, scene) == (0.0, "energy is conserved")
    asked.of = "max_displacement"
    assert closed_form(asked, scene) == (None, "")


def test_the_error_of_the_energies_is_round_off(scene, folder):
    value, _ = value_of(quantity_of("energy.error", scene), folder)
    assert 0.0 <= value < 1e-9
    assert value == value_of(quantity_of("0:energy.error", scene), folder)[0]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("stress_yy(1, 2, 3)", "three or more corners"),
        ("1:stress_yy(1, 2)", "circle"),
        ("1:stress_yy(1, 2, -3)", "radius is not above 0"),
        ("stress_yy(0, 0, 1, 1, 1, 0, 0, 1)", "crosses itself"),
        ("displacement_y(0, 0, 1, 0, 0, 1)", "only stresses have means"),
    ],
)
def test_what_is_no_region_is_refused(scene, text, words):
    with pytest.raises(SceneError, match=words):
        quantity_of(text, scene)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("fabric_a", "no discs of rank 1"),
        ("2:stress_yy(1, 1, 0.5)", "no discs of rank 2"),
        ("stress_yy(8, 8, 9, 8, 9, 9)", "no zone has its centre"),
        ("failure_gravity", "no stage of kind overload"),
    ],
)
def test_what_a_run_has_not_is_said(scene, folder, text, words):
    with pytest.raises(LookupError, match=words):
        value_of(quantity_of(text, scene), folder)


def test_a_direction_of_the_fabric_comes_with_its_interval(monkeypatch):
    fabric = SimpleNamespace(a=0.2, a_interval=(0.15, 0.26), theta_a=85.0, theta_a_error=6.0)
    monkeypatch.setattr(measured.band_states, "fabric", lambda *_: (fabric, None))
    run = SimpleNamespace(windows=[1], frames=[None], last_frame=lambda name: 0)
    for text, value, half in (("fabric_a", 0.2, 0.06), ("1:fabric_theta_a", 85.0, 6.0)):
        found = measured.value_of(quantity_of(text, SimpleNamespace(stage=[], grid=None)), run)
        assert np.allclose(found, (value, half))
