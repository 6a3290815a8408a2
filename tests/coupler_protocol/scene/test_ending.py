"""A stage ends on the ratios of both codes, sustained, and never inside a ramp."""

from types import SimpleNamespace

import pytest

from coupler_protocol.scene.ending import SUSTAINED, Ending, least_steps
from coupler_protocol.scene.tables.stages import Until

CALM, MOVING = 0.9e-5, 2e-5


def ending(not_before=0, **until):
    nothing = {"ratio": 1e-5, "steps": None, "time": None, "displacement": None}
    return Ending(SimpleNamespace(**nothing | until), not_before)


def looks(found, rows, steps=100):
    """What each look said."""
    return [found.reached(steps, row, 0.0) for row in rows]


@pytest.mark.parametrize("rows", [[(CALM, MOVING)] * 50, [(MOVING, CALM)] * 50, [(CALM, CALM, MOVING)] * 50])
def test_one_code_at_rest_is_not_enough(rows):
    assert looks(ending(), rows) == [""] * 50


def test_both_must_be_at_rest_for_some_looks_in_a_row():
    assert looks(ending(), [(CALM, CALM)] * SUSTAINED) == [""] * (SUSTAINED - 1) + ["ratio 9e-06"]
    broken = ([(CALM, CALM)] * (SUSTAINED - 1) + [(CALM, MOVING)]) * 5
    assert not any(looks(ending(), broken))


def test_not_inside_a_ramp():
    found = ending(not_before=101)
    assert not any(looks(found, [(CALM, CALM)] * 20, 100))
    assert looks(found, [(CALM, CALM)], 101) == ["ratio 9e-06"]


@pytest.mark.parametrize(
    ("until", "ramp", "steps"),
    [
        ({"steps": 40000}, None, 40000),
        ({"steps": 300}, 40000, 300),
        ({"steps": 40000, "ratio": 1e-5}, None, 0),
        ({"steps": 40000, "ratio": 1e-5}, 6000, 6000),
        ({"steps": 500, "ratio": 1e-5}, 6000, 500),
        ({"ratio": 1e-5}, 6000, 6000),
        ({"steps": 40000, "displacement": 0.1}, 6000, 0),
        ({"steps": 40000, "band": "complete"}, 6000, 0),
        ({"steps": 40000, "time": 1.0}, 6000, 0),
    ],
)
def test_the_steps_that_a_stage_takes_at_least(until, ramp, steps):
    gravity_factor = None if ramp is None else SimpleNamespace(to=2.0, over=ramp)
    assert least_steps(SimpleNamespace(until=Until(**until), gravity_factor=gravity_factor)) == steps


def test_a_stage_without_steps_takes_none():
    assert least_steps(SimpleNamespace(until=None, gravity_factor=None)) == 0
