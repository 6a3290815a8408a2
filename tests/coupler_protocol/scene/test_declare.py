"""Numbers of a scene are numbers: texts and truth values are refused wherever a number is declared."""

import copy
import tomllib

import pytest

from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import build_scene


@pytest.fixture
def good(configs):
    return tomllib.loads((configs / "quick_slope.toml").read_text(encoding="utf-8"))


def changed(data, path, value):
    data = copy.deepcopy(data)
    place = data
    for part in path[:-1]:
        place = place[part]
    place[path[-1]] = value
    return data


NUMBERS = [
    (("material", 0, "density"), 2000),
    (("material", 0, "elastic", "bulk"), 5e8),
    (("material", 0, "mohr_coulomb", "friction"), 30.0),
    (("grid", "zone_size"), 1.0),
    (("grid", "length"), 20.0),
    (("discs", "radius"), 0.055),
    (("discs", "soil", "spring", "normal"), 5e7),
    (("stage", 0, "gravity"), 9.81),
    (("stage", 0, "until", "ratio"), 1e-5),
    (("stage", 0, "until", "steps"), 200),
    (("stage", 3, "gravity_factor"), 3.0),
    (("seed",), 1),
    (("format",), 1),
    (("record", "every"), 100),
]


@pytest.mark.parametrize(("path", "value"), NUMBERS)
def test_a_number_as_text_or_a_truth_value_is_refused(good, path, value):
    for wrong in (str(value), True):
        with pytest.raises(SceneError) as found:
            build_scene(changed(good, path, wrong))
        problem = found.value.problems[0]
        assert problem.key.split(".")[-1] == path[-1]
        assert problem.remedy
    words = "a number or {" if path[-1] == "gravity_factor" else "without quotation marks"
    assert words in str(_refusal(good, path, str(value)))


def _refusal(good, path, wrong):
    with pytest.raises(SceneError) as found:
        build_scene(changed(good, path, wrong))
    return found.value


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("grid", "profile"), [["0.0", 4.0], [3.3333333, 4.0], [11.3333333, 12.0], [20.0, 12.0]]),
        (("window", 0, "columns"), [16, True]),
        (("grid", "zone_size"), [0.6666666666666666, "0.6666666666666666"]),
    ],
)
def test_numbers_in_lists_are_numbers(good, path, value):
    assert "is not a number" in str(_refusal(good, path, value))


def test_truth_values_and_whole_numbers_stay_what_they_are(good):
    good["record"] = {"every": 100.0, "energy": True}
    good["discs"]["density_matching"] = False
    good["stage"][3]["large_strain"] = True
    good["record"].pop("energy")
    scene = build_scene(good)
    assert scene.record.every == 100
    assert scene.discs.density_matching is False
    assert scene.stage[3].large_strain is True


@pytest.mark.parametrize("value", ["true", "no", 1, 0, 1.0])
@pytest.mark.parametrize("path", [("grid", "large_strain"), ("stage", 0, "discard"), ("discs", "density_matching")])
def test_truth_values_are_true_or_false(good, path, value):
    """1 and "no" would be taken for true and false."""
    with pytest.raises(SceneError, match="is not true or false") as found:
        build_scene(changed(good, path, value))
    assert f"{path[-1]} = true" in str(found.value)


@pytest.mark.parametrize(("text", "meant"), [("0,055", "0.055"), ("2,7e3", "2.7e3")])
def test_a_decimal_comma_is_named(good, text, meant):
    with pytest.raises(SceneError, match="decimals have a point") as found:
        build_scene(changed(good, ("discs", "radius"), text))
    assert f"radius = {meant}, without quotation marks" in str(found.value)
