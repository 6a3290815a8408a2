"""Scenes of a coupled search: which stages come to rest first, and what is refused in words."""

from types import SimpleNamespace

import pytest

from colluvium.safety import scenes
from tests.colluvium.safety.small_slope import SOIL, scene, tables


def options(**given):
    return SimpleNamespace(**{"by": None, "meshes": None, "flow": None} | given)


def test_trials_begin_before_the_overload(configs):
    data = tables(configs)
    data["stage"].insert(1, {"name": "locate", "discard": True, "gravity_factor": 3.0, "until": {"steps": 10}})
    data["stage"].insert(1, {"name": "trial", "kind": "load", "until": {"ratio": 1e-5, "steps": 10}})
    found = scenes.base_tables(scenes.checked(data))
    assert [stage["name"] for stage in found["stage"]] == ["equilibrium", "trial", "fill", "couple"]
    base = scenes.checked(found)
    trial = scenes.trial_tables(base, found, 1.3, 700)["stage"][-1]
    assert (trial["name"], trial["until"]) == ("trial_", {"steps": 700})
    assert scenes.is_coupled(base)


def changed(key, value, stage=None):
    def change(data):
        (data if stage is None else data["stage"][stage]).update({key: value})

    return change


def later(data):
    data["stage"].append({"name": "more", "kind": "load", "until": {"ratio": 1e-5, "steps": 10}})


def own_discs(data):
    data["window"][0]["discs"] = {"soil": {"friction": {"coefficient": 0.3}}}


@pytest.mark.parametrize(
    ("change", "given", "key", "why"),
    [
        (lambda d: None, {"by": "gravity"}, "fos.by", "grows in a stage of kind overload"),
        (lambda d: None, {"meshes": 2}, "fos.zone_sizes", "zones of one mesh"),
        (lambda d: None, {"flow": "both"}, "fos.flow", "one flow rule"),
        (later, {}, "stage", "'more' follows an overload"),
        (changed("time", "real", 2), {}, "stage couple.time", "static"),
        (changed("until", {"steps": 100}, 2), {}, "stage couple.until", "slope at rest"),
        (own_discs, {}, "window.discs", "all windows alike"),
    ],
)  # fmt: skip
def test_what_cannot_be_searched_is_named(configs, change, given, key, why):
    data = tables(configs)
    change(data)
    if key == "stage couple.time":
        data["stage"][2] |= {"until": {"time": 0.1, "ratio": 1e-5}}
    (found,) = scenes.problems_of(scenes.checked(data), "slope.toml", options(**given))
    assert found.key == key
    assert why in found.reason
    assert found.remedy


def test_a_scene_that_can_be_searched(configs):
    assert scenes.problems_of(scene(configs, soil=SOIL), "slope.toml", options()) == []
