"""Gravity over the stages: inherited, ramped, and forgotten with a discarded stage."""

from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coupler_protocol.scene.schedule import Leg, leg_of, plan


def stage(gravity=None, to=None, over=0, discard=False):
    ramp = None if to is None else SimpleNamespace(to=to, over=over)
    return SimpleNamespace(gravity=gravity, gravity_factor=ramp, discard=discard)


def legs(*stages):
    return plan(SimpleNamespace(stage=stages))


def test_gravity_and_its_factor_stay_until_changed():
    found = legs(stage(9.81), stage(), stage(to=3.0, over=100), stage(), stage(1.62), stage(to=1.0))
    assert found == [
        Leg(9.81, 1.0, 1.0, 0),
        Leg(9.81, 1.0, 1.0, 0),
        Leg(9.81, 1.0, 3.0, 100),
        Leg(9.81, 3.0, 3.0, 0),
        Leg(1.62, 3.0, 3.0, 0),
        Leg(1.62, 3.0, 1.0, 0),
    ]


def test_there_is_no_gravity_before_any_is_given():
    assert legs(stage(), stage(9.81))[0] == Leg(0.0, 1.0, 1.0, 0)


def test_a_discarded_stage_leaves_no_trace():
    found = legs(stage(9.81), stage(20.0, to=9.0, discard=True), stage(to=2.0, over=10))
    assert found[1] == Leg(20.0, 1.0, 9.0, 0)
    assert found[2] == Leg(9.81, 1.0, 2.0, 10)


def test_a_ramp_is_linear_and_ends_exactly():
    leg = Leg(10.0, 1.0, 3.0, 4)
    assert [leg.factor(i) for i in range(6)] == [1.5, 2.0, 2.5, 3.0, 3.0, 3.0]
    assert leg.at(0) == 15.0


def test_without_a_ramp_the_new_value_holds_from_the_first_step():
    assert Leg(9.81, 1.0, 9.0, 0).factor(0) == 9.0


def test_a_stage_goes_on_from_what_was_reached():
    ended_early = Leg(9.81, 1.0, 3.0, 100)
    reached = ended_early.factor(49)
    assert leg_of(stage(), ended_early.gravity, reached) == Leg(9.81, 2.0, 2.0, 0)
    assert leg_of(stage(to=5.0, over=10), ended_early.gravity, reached) == Leg(9.81, 2.0, 5.0, 10)
    assert leg_of(stage(1.62), ended_early.gravity, reached) == Leg(1.62, 2.0, 2.0, 0)


@given(st.floats(0.0, 50.0), st.floats(0.0, 50.0), st.integers(0, 1000), st.integers(0, 2000))
def test_a_ramp_never_leaves_its_bounds_and_never_turns_back(start, end, over, step):
    leg = Leg(1.0, start, end, over)
    low, high = min(start, end), max(start, end)
    here, following = leg.factor(step), leg.factor(step + 1)
    slack = 1e-12 * high
    assert low - slack <= here <= high + slack
    assert (following - here) * (end - start) >= -slack * abs(end - start)
    if step + 1 >= over:
        assert here == end


def test_the_shipped_scene_climbs_to_three_times_gravity(configs):
    from coupler_protocol.scene.reader import read_scene

    last = plan(read_scene(configs / "quick_slope.toml"))[-1]
    assert last == Leg(9.81, 1.0, 3.0, 1000)
    assert last.at(999) == pytest.approx(29.43, rel=1e-15)
