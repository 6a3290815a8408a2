"""Ramps of loads: step by step as they ever were, or by parts that wait for rest."""

from types import SimpleNamespace

import numpy as np
import pytest

from coupler_protocol.scene.tables.boundary import Boundary
from fdm_server.ground.load_steps import KEPT, LAST, PARTS, SUSTAINED, Ramp, ramp_of

YIELDING, ELASTIC = SimpleNamespace(path_dependent=True), SimpleNamespace(path_dependent=False)


def shares(ramp, steps, ratio=0.0):
    """Shares of the load in so many steps, in each of which the ramp sees a ratio."""
    found = []
    for _ in range(steps):
        found.append(ramp.share)
        ramp.see(ratio) if ramp.waits else None
        ramp.step_done()
    return found


@pytest.mark.parametrize("over", [1, 3, 8])
def test_step_by_step(over):
    assert shares(Ramp(over), 10) == [min(1.0, (n + 1) / over) for n in range(10)]


def test_a_load_put_on_moves_once():
    ramp = Ramp(2)
    moves = []
    for _ in range(4):
        moves.append(ramp.moves)
        ramp.step_done()
    assert moves == [True, True, False, False]
    assert ramp.complete


@pytest.mark.parametrize("over", [2, PARTS, 500])
def test_parts_leave_the_same_share_of_what_was_left(over):
    ramp = Ramp(over, 1e-3)
    held = []
    while not ramp.complete:
        if ramp.waits:
            held.append(ramp.share)
            for _ in range(SUSTAINED):
                assert ramp.waits
                ramp.see(0.5e-3)
        ramp.step_done()
    np.testing.assert_allclose(1.0 - np.array(held), KEPT ** np.arange(1, PARTS), rtol=1e-12)
    assert KEPT * LAST < 1.0 - held[-1] <= LAST
    assert ramp.share == 1.0
    assert np.all(np.diff(held) > 0.0)


def test_a_part_lasts_until_rest_is_sustained():
    ramp = Ramp(PARTS, 1e-3)
    assert ramp.waits
    first = ramp.share
    for ratio in [1e-4] * (SUSTAINED - 1) + [1.0] + [1e-4] * (SUSTAINED - 1):  # never so often in a row
        ramp.see(ratio)
        ramp.step_done()
        assert ramp.share == first
    ramp.see(1e-4)
    ramp.step_done()
    assert ramp.share > first


def test_ground_that_does_not_come_to_rest_keeps_its_share():
    ramp = Ramp(100, 1e-3)
    found = shares(ramp, 5000, ratio=1.0)
    assert not ramp.complete
    assert found[-1] == found[100] == pytest.approx(1.0 - KEPT)


def scene(until=None, time="static", boundary=(), kinds=("load",)):
    """A scene of one stage or more, as far as a ramp asks."""
    ends = SimpleNamespace(ratio=None, steps=5000) if until is None else until
    stages = [SimpleNamespace(kind=kind, in_real_time=time == "real", until=ends, boundary=[], discard=False) for kind in kinds]
    return SimpleNamespace(stage=stages, boundary=list(boundary))


REST = SimpleNamespace(ratio=1e-6, steps=5000)


@pytest.mark.parametrize(("given", "law", "over", "ratio", "found"), [
    ({"until": REST}, YIELDING, 100, None, 3e-4),
    ({"until": SimpleNamespace(ratio=1e-3, steps=None)}, YIELDING, 100, None, 1e-3),
    ({"until": REST}, YIELDING, 100, 0.0, 0.0),  # as the scene says: the number of steps is fixed
    ({"until": REST}, YIELDING, 100, 1e-5, 1e-5),
    ({"until": REST}, YIELDING, 1, None, 0.0),  # at once is at once
    ({"until": REST}, ELASTIC, 100, None, 0.0),  # any way leads to the same rest
    ({"until": REST, "kinds": ("couple", "load")}, ELASTIC, 100, None, 3e-4),  # but discs slide
    ({}, YIELDING, 100, None, 0.0),  # the stage ends by its steps
    ({"until": REST, "time": "real"}, YIELDING, 100, None, 0.0),
    ({"until": REST, "boundary": [Boundary(on="top", velocity={"y": -1e-6})]}, YIELDING, 100, None, 0.0),
    ({"until": REST, "boundary": [Boundary(on="top", velocity={"y": 0.0})]}, YIELDING, 100, None, 3e-4),
])  # fmt: skip
def test_which_loads_wait(given, law, over, ratio, found):
    of = scene(**given)
    assert ramp_of(of, len(of.stage) - 1, law, over, ratio).ratio == found


@pytest.mark.parametrize(("until", "gradual", "ratio", "over"), [
    (REST, True, None, 504),  # 500, rounded up to whole parts
    (REST, False, None, 1),  # loads that a scene begins with
    (REST, False, 1e-4, 504),  # but where it says so
    (REST, True, 0.0, 1),
    (None, True, None, 1),
])  # fmt: skip
def test_steps_of_loads_that_give_none(until, gradual, ratio, over):
    of = scene(until=until)
    assert ramp_of(of, 0, YIELDING, None, ratio, gradual).over == over
