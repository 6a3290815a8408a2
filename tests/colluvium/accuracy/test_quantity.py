"""Quantities by their text, and their values in a run."""

import numpy as np
import pytest

from colluvium import api
from colluvium.accuracy import quantity
from colluvium.accuracy.quantity import quantity_of, value_of
from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import build_scene
from tests.small_grounds import REST, TABLES


@pytest.fixture(scope="module")
def scene():
    return build_scene(
        TABLES | {"boundary": [{"on": side, "fix": fix} for side, fix in SIDES], "stage": [START, REST | {"kind": "load"}]}
    )


START = {"name": "start", "kind": "equilibrium", "gravity": 0.0, "until": {"steps": 1}}
SIDES = (("bottom", "xy"), ("left", "x"), ("right", "x"))


@pytest.fixture(scope="module")
def folder(scene, tmp_path_factory):
    out = tmp_path_factory.mktemp("column")
    api.run(scene, out, in_process=True)
    return out


@pytest.mark.parametrize(
    ("text", "name", "rank", "place", "stage"),
    [
        ("fos", "fos", None, None, None),
        ("max_displacement", "max_displacement", None, None, None),
        ("1:porosity@rest", "porosity", 1, None, "rest"),
        ("reaction_y:bottom", "reaction_y:bottom", None, None, None),
        ("stress_xx(0.5, -2e0)@rest", "stress_xx", None, (0.5, -2.0), "rest"),
    ],
)
def test_parts_of_a_text(scene, text, name, rank, place, stage):
    found = quantity_of(text, scene)
    assert (found.name, found.rank, found.place, found.stage) == (name, rank, place, stage)


@pytest.mark.parametrize("text", ["", "stress_xx(1)", "a b", "max_displacement@nowhere", "stress_xx(1, 2"])
def test_what_is_no_quantity_is_refused(scene, text):
    with pytest.raises(SceneError, match="--of"):
        quantity_of(text, scene)


def test_a_field_at_a_place_is_that_of_a_column_under_its_weight(scene, folder):
    """stress_yy = -rho g (H - y), linear: also at the surface, where there is no centre of a zone beyond."""
    for y in (0.1, 1.7, 4.0):
        value, half_width = value_of(quantity_of(f"stress_yy(1.3, {y})", scene), folder)
        assert value == pytest.approx(-2000.0 * 9.81 * (4.0 - y), abs=30.0)
        assert half_width == 0.0
    top, _ = value_of(quantity_of("displacement_y(2, 4)@rest", scene), folder)
    modulus = 5e7 + 4 / 3 * 2e7
    assert top == pytest.approx(-2000.0 * 9.81 * 4.0**2 / (2 * modulus), rel=1e-4)


def test_a_history_is_its_last_value(scene, folder):
    value, _ = value_of(quantity_of("unbalanced_ratio@rest", scene), folder)
    assert 0.0 < value <= 1e-5


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("stress_yy(5, 1)", "is in no zone"),
        ("stress(1, 1)", "has several columns: name one of them, such as stress_yy"),
        ("nothing(1, 1)", "has no field"),
        ("nothing", "has no history"),
        ("1:porosity", "rank 1"),
    ],
)
def test_what_the_run_did_not_record_is_said(scene, folder, text, words):
    with pytest.raises(LookupError, match=words):
        value_of(quantity_of(text, scene), folder)


def test_a_place_is_in_the_triangle_of_corners_around_it():
    """A trapezium and a triangle beside it; (2.5, 0.1) is in the triangle, (0, 3) in none."""
    xy = np.array([[0.0, 0.0], [2.0, 0.0], [1.5, 1.0], [0.5, 1.0], [3.0, 0.0]])
    zones = np.array([[0, 1, 2, 3], [1, 4, 2, 2]])
    values = 1.0 - 2.0 * xy[:, 0] + 3.0 * xy[:, 1]
    for place in ((1.0, 0.5), (0.5, 1.0), (2.5, 0.1), (1.75, 0.5)):
        share, corners = quantity._triangle(np.array(place), xy, zones)
        assert share.min() >= -1e-12
        assert share @ values[corners] == pytest.approx(1.0 - 2.0 * place[0] + 3.0 * place[1], abs=1e-12)
    assert quantity._triangle(np.array([0.0, 3.0]), xy, zones)[0].min() < -0.1


def test_a_plane_is_exact_for_linear_fields_at_any_place():
    xy = np.random.default_rng(1).uniform(size=(30, 2))
    for place in ((0.5, 0.5), (0.0, 1.0)):
        found = quantity._plane_at(np.array(place), xy, 3.0 + xy @ [2.0, -5.0])
        assert found == pytest.approx(3.0 + 2.0 * place[0] - 5.0 * place[1], rel=1e-12)
