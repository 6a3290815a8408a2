"""Which stages should end at rest, and which may end in motion without a word."""

import tomllib

import pytest

from coupler_protocol.process.plugin import from_functions
from coupler_protocol.scene import rest
from coupler_protocol.scene.reader import build_scene, read_scene
from tests.small_grounds import BOX


def box(**stage):
    """A scene whose second stage has these keys."""
    first = {"name": "rest", "kind": "equilibrium", "gravity": 9.81, "until": {"steps": 5}}
    return build_scene(tomllib.loads(BOX) | {"stage": [first, {"name": "next"} | stage]})


PIT = {"columns": [1, 2], "rows": [3, 3]}
TOP = {"x": [0.5, 1.5], "pressure": 1e3}


@pytest.mark.parametrize(
    ("stage", "limit"),
    [
        ({"kind": "equilibrium", "until": {"steps": 5}}, rest.LIMIT),
        ({"kind": "equilibrium", "until": {"steps": 5, "ratio": 1e-6}}, 1e-6),
        ({"kind": "excavate", "excavate": PIT, "until": {"steps": 5}}, rest.LIMIT),
        ({"kind": "excavate", "excavate": PIT, "until": {"steps": 5, "displacement": 1.0}}, None),
        ({"kind": "surcharge", "surcharge": TOP, "until": {"steps": 5}}, rest.LIMIT),
        ({"kind": "overload", "gravity_factor": 9.0, "until": {"steps": 5}}, None),
        ({"kind": "overload", "gravity_factor": 9.0, "until": {"steps": 5, "ratio": 1e-5}}, 1e-5),
        ({"kind": "overload", "gravity_factor": 9.0, "until": {"steps": 5, "ratio": 1e-5, "displacement": 1.0}}, 1e-5),
        ({"kind": "load", "boundary": [{"on": "top", "pressure": 1e3}], "until": {"steps": 5}}, rest.LIMIT),  # as a surcharge
        ({"kind": "load", "boundary": [{"on": "top", "velocity": {"y": -1e-6}}], "until": {"steps": 5}}, None),
        ({"kind": "equilibrium", "time": "real", "until": {"steps": 5}}, None),
        (
            {"kind": "equilibrium", "boundary": [{"on": "top", "velocity": {"y": -1e-6}}], "until": {"steps": 5}},
            None,
        ),
        ({"kind": "equilibrium", "boundary": [{"on": "top", "velocity": {"y": 0.0}}], "until": {"steps": 5}}, rest.LIMIT),
    ],
)
def test_which_stages_of_a_grid_should_rest(stage, limit):
    assert rest.limit(box(**stage), 1) == limit


def test_discs_rest_unless_a_wall_moves(tmp_path):
    wall = {"name": "plate", "ends": [[0.0, 0.0], [1.0, 0.0]], "velocity": [0.0, -1e-4]}
    soil = {"density": 2000.0, "spring": {"normal": 1e7, "shear": 1e7}}
    stages = [{"name": "fill"}, {"name": "a", "kind": "discs", "until": {"steps": 5}}]
    stages += [{"name": "b", "kind": "discs", "until": {"steps": 5}, "wall": [{"name": "plate"}]}]
    window = [{"name": "w", "polygon": [[0, 0], [1, 0], [1, 1], [0, 1]]}]
    scene = build_scene(
        {"format": 1, "seed": 1, "window": window, "discs": {"radius": 0.05, "soil": soil, "wall": [wall]}, "stage": stages}
    )
    assert [rest.limit(scene, index) for index in range(3)] == [None, None, rest.LIMIT]


def test_functions_of_the_user_may_keep_a_stage_in_motion():
    scene = box(kind="equilibrium", until={"steps": 5})
    assert rest.shortfall(scene, 1, "5 steps", 0.5, from_functions(on_stage=print))
    assert rest.shortfall(scene, 1, "5 steps", 0.5, from_functions(on_step=(1, print))) == ""
    asked = box(kind="equilibrium", until={"steps": 5, "ratio": 1e-4})
    assert rest.shortfall(asked, 1, "5 steps", 0.5, from_functions(on_step=(1, print)))


def test_the_warning_says_how_far_from_rest_and_what_to_do():
    scene = box(kind="equilibrium", until={"steps": 5})
    assert rest.shortfall(scene, 1, "5 steps", 9.9e-4) == ""
    text = rest.shortfall(scene, 1, "5 steps", 3.6e-2)
    assert text.startswith(
        "the stage ended after 5 steps at a ratio of 0.036, above 0.001: it moves on, or fails. Give it more steps"
    )


def test_overload_of_the_paper_until_failure_is_not_asked_for_rest(configs):
    scene = read_scene(configs / "paper_slope.toml")
    assert [rest.limit(scene, index) for index in range(len(scene.stage))][-1] is None
