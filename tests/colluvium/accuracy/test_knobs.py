"""Knobs and the settings that they make of a scene."""

import pytest

from colluvium.accuracy.knobs import knobs_of, seeded, settings_of
from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import read_scene


@pytest.fixture(scope="module")
def scene(configs):
    return read_scene(configs / "softening_slide.toml")


def test_values_are_given_or_shares_of_the_scenes_value(scene):
    by_value, by_share = knobs_of(["zone_size=0.5,0.25", "grid.height=/1,/2,/4"], scene)
    assert (by_value.keys, by_value.values, by_value.to_zero) == (("grid.zone_size",), (0.5, 0.25), True)
    height = scene.grid.height
    assert by_share.values == (height, height / 2, height / 4)
    assert not by_share.to_zero


def test_a_knob_of_stages_turns_all_that_have_the_key(scene):
    (knob,) = knobs_of(["ratio=1e-3,1e-4"], scene)
    having = [stage.name for stage in scene.stage if stage.until is not None and stage.until.ratio is not None]
    assert having
    assert knob.keys == tuple(f"stage.{name}.until.ratio" for name in having)


def test_settings_are_all_combinations_with_their_overrides(scene):
    knobs = [*knobs_of(["zone_size=[1.0, 0.5],0.5", "discs.radius=0.2,0.1"], scene), seeded(scene, 2)]
    found = settings_of(knobs)
    assert len(found) == 8
    assert found[0].name == f"zone_size=[1, 0.5], discs.radius=0.2, seed={scene.seed}"
    assert found[-1].changes == ("grid.zone_size=0.5", "discs.radius=0.1", f"seed={scene.seed + 1}")


def test_a_count_of_zones_has_its_reciprocal_as_size(configs):
    (knob,) = knobs_of(["grid.around=8,16"], read_scene(configs / "hole.toml"))
    assert [knob.size(value) for value in knob.values] == [1 / 8, 1 / 16]
    assert knob.to_zero


def test_a_knob_without_values_begins_coarser_than_the_scene(scene):
    (knob,) = knobs_of(["zone_size"], scene)
    base = scene.resolved()["grid"]["zone_size"]
    assert knob.open_ended
    assert knob.values[0] == [2 * size for size in base]
    assert knob.values[1] == base
    assert settings_of([knob])[1].name == f"zone_size={base[0]:g}"


def test_a_count_without_values_begins_with_fewer(configs):
    (knob,) = knobs_of(["grid.around"], read_scene(configs / "hole.toml"))
    assert knob.values[:3] == (12, 24, 48)


def test_all_problems_of_knobs_are_reported_at_once(scene):
    with pytest.raises(SceneError) as error:
        knobs_of(["zone_size=1", "=3,4", "grid.height=2,2", "title=/2,/3", "dt=0.1,0.2x"], scene)
    text = str(error.value)
    for words in ("has fewer than two values", "has no name", "has a value twice", "no number that could be divided"):
        assert words in text
    with pytest.raises(SceneError, match="is given twice"):
        knobs_of(["zone_size=1,2", "zone_size=3,4"], scene)


def test_zones_and_steps_have_the_formal_order_two_radii_and_ratios_one(scene):
    knobs = knobs_of(["zone_size=/1,/2", "radius=0.2,0.1", "ratio=1e-3,1e-4"], scene)
    assert [knob.formal_order for knob in knobs] == [2.0, 1.0, 1.0]


def test_more_steps_between_exchanges_are_coarser_in_whatever_order_they_are_given(scene):
    given, opened = knobs_of(["exchange_every=1,10,5"], scene), knobs_of(["coupling.exchange_every"], scene)
    assert given[0].values == (10, 5, 1)
    assert opened[0].values == (50, 20, 10, 5, 2, 1)
    assert opened[0].open_ended
    assert not opened[0].to_zero


def test_time_steps_are_those_of_stages_in_real_time_with_or_without_a_factor_of_their_own(configs):
    (knob,) = knobs_of(["dt=0.8,0.4"], read_scene(configs / "quick_shaking.toml"))
    assert knob.keys == ("stage.shake.step_factor",)
    assert knob.formal_order == 2.0
    with pytest.raises(SceneError, match="static stages have no time step to choose"):
        knobs_of(["dt=0.8,0.4"], read_scene(configs / "quick_slope.toml"))
