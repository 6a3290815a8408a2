"""When checkpoints inside of stages are due, and what they cost at most."""

from types import SimpleNamespace

import pytest

from coupler_protocol.process.checkpoint_clock import APART, CheckpointClock


@pytest.fixture
def clock():
    """A clock of 10 s, and `time.now`, which a test moves on."""
    time = SimpleNamespace(now=0.0)
    return CheckpointClock(10.0, None, lambda: time.now), time


def test_by_wall_time(clock):
    clock, time = clock
    assert not clock.due(5)
    time.now = 10.0
    assert clock.due(6)
    clock.begins(6)
    time.now = 10.05
    assert not clock.due(8)
    time.now = 20.0
    assert clock.due(900)


def test_a_checkpoint_costs_a_hundredth_of_the_time_at_most(clock):
    clock, time = clock
    clock.begins(1)
    time.now = 0.7  # the next step of all sides begins
    assert not clock.due(2)
    assert clock.cost == 0.7
    time.now = 69.9
    assert not clock.due(500)
    time.now = 70.0
    assert clock.due(501)


def test_by_steps_at_their_number():
    clock = CheckpointClock(0.0, 100, lambda: 0.0)
    clock.begins(250)
    assert next(step for step in range(251, 500) if clock.due(step)) == 350
    assert clock.steps_before(301) == 49
    assert clock.steps_before(350) == 0
    assert CheckpointClock(1.0, None).steps_before(7) == float("inf")


def test_a_stop_waits_until_all_sides_have_completed_the_last_checkpoint():
    clock = CheckpointClock(0.0, None, lambda: 0.0)
    assert not clock.due(1)
    assert clock.due(1, stop=True)
    clock.begins(7)
    assert [clock.due(step, stop=True) for step in (8, 7 + APART)] == [False, True]
