"""Stages that end late or never are named; a ratio below round-off is refused where nothing else ends the stage."""

import copy
import tomllib

import pytest

from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import build_scene
from coupler_protocol.scene.rules.between_tables import doubts
from coupler_protocol.scene.rules.endings import round_off


@pytest.fixture(scope="module")
def slope(configs):
    data = tomllib.loads((configs / "griffiths_lane.toml").read_text(encoding="utf-8"))
    del data["fos"]
    return data


@pytest.fixture(scope="module")
def biaxial(configs):
    return tomllib.loads((configs / "quick_biaxial.toml").read_text(encoding="utf-8"))


def until(data, number, **ends):
    data = copy.deepcopy(data)
    data["stage"][number]["until"] = ends
    return data


def said(data):
    return " | ".join(what for _, what, _ in doubts(build_scene(data)))


def test_a_ratio_below_round_off_is_refused_alone_and_doubted_beside_steps(slope, biaxial):
    for data, number, ratio in ((slope, 0, 1e-16), (biaxial, 1, 1e-13)):
        with pytest.raises(SceneError) as found:
            build_scene(until(data, number, ratio=ratio))
        (problem,) = found.value.problems
        assert problem.key == f"stage[{number}].until.ratio"
        assert "would never end" in problem.reason
        assert "add steps" in problem.remedy
        assert f"never reaches the ratio {ratio:g}" in said(until(data, number, ratio=ratio, steps=100))
        assert said(until(data, number, ratio=1e-5, steps=100)) == ""


def test_the_round_off_of_discs_is_that_of_their_places(biaxial):
    """1 m, k/2 = 2.5e7 N/m, 100 kPa on discs of 7 cm: 2.2e-16 * 2 m * 2.5e7 / 7e3 N."""
    assert round_off(build_scene(biaxial)) == pytest.approx(2.2e-16 * 2.0 * 2.5e7 / 7e3)
    far = copy.deepcopy(biaxial)
    far["window"][0]["polygon"] = [[x + 400e3, y] for x, y in far["window"][0]["polygon"]]
    del far["measure"]  # a region of the shipped scene, which stays where it is
    assert round_off(build_scene(far)) < 1e-8  # computed about a local origin


@pytest.mark.parametrize(
    ("ends", "words"),
    [
        ({"ratio": 1e-12}, "ends only at rest, ratio 1e-12"),
        ({"displacement": 0.5}, "ends only if something moves by 0.5 m"),
        ({"displacement": 500.0, "steps": 100}, "a displacement of 500 m, more than the height of the ground, 15 m"),
    ],
)
def test_stages_that_may_never_end_are_doubted(slope, ends, words):
    assert words in said(until(slope, 0, **ends))


def test_steps_or_two_conditions_are_not_doubted(slope):
    for ends in ({"steps": 100}, {"ratio": 1e-5, "steps": 100}, {"ratio": 1e-5, "displacement": 1.0}):
        assert said(until(slope, 0, **ends)) == ""


def test_more_seconds_than_steps_can_take_are_doubted(configs, slope):
    """A zone of 0.625 m at 260 m/s: steps of about a millisecond; a disc of 4 cm on 5e7 N/m: of 0.04 ms."""
    real = copy.deepcopy(slope)
    real["stage"].append(
        {"name": "slide", "kind": "overload", "time": "real", "damping": {"local": 0.0}, "until": {"time": 10.0}}
    )
    assert said(real) == ""
    real["stage"][-1]["until"]["time"] = 1e9
    assert "of 1e+09 s takes about 8e+11 steps of 0.001 s" in said(real)
    pile = tomllib.loads((configs / "quick_pile.toml").read_text(encoding="utf-8"))
    pile["stage"][1]["until"] = {"time": 1e6}
    assert "takes about" in said(pile)


def test_hand_overs_longer_than_their_stage_are_doubted(configs):
    coupled = tomllib.loads((configs / "quick_slope.toml").read_text(encoding="utf-8"))
    coupled["stage"][2] = {"name": "couple", "until": {"steps": 499}}
    assert "ends after 499 steps, inside its hand-over of 500" in said(coupled)
    coupled["stage"][2]["handover"] = 499
    assert "hand-over" not in said(coupled)


def test_a_ramp_of_gravity_that_the_steps_cut_off_is_doubted(slope):
    data = until(slope, 0, steps=2000)
    data["stage"][0]["gravity_factor"] = {"to": 3.0, "over": 5000}
    assert "within its ramp of gravity over 5000: the factor reaches 1.8, not 3" in said(data)
    data["stage"][0]["gravity_factor"]["over"] = 2000
    assert "ramp of gravity" not in said(data)
