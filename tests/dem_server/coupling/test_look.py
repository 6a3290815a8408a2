"""What compiled code sees of the discs at points of histories is what the functions of the loop step by step compute."""

from types import SimpleNamespace

import numpy as np
import pytest

from coupler_protocol.wire.messages import Answer
from dem_server.coupling import look
from dem_server.coupling.ring_guard import RingGuard
from dem_server.effects.histories import PairHistory, history_of
from dem_server.model import Listed
from dem_server.observe import energy
from dem_server.observe.unbalanced_ratio import unbalanced_ratio
from dem_server.step.contact_pass import contact_forces
from dem_server.step.motion import move_free
from dem_server.step.neighbours import rebuild
from tests.dem_server.window_case import ANGLE, packed, soil_discs


@pytest.fixture
def window():
    """An L with discs of 0.06 m that have moved for some steps: side as a Sight wants it."""
    model, state = packed(ANGLE, soil_discs(0.06))
    for _ in range(5):
        move_free(model, state, 9.81)
        contact_forces(model, state)
    guard = RingGuard(model, state)
    return SimpleNamespace(model=model, state=state, guard=guard, power=12.5, record_of_stage=SimpleNamespace(history=10))


def looked(side, sight, done=40):
    """The Answer of a look, and whether something has to be judged at once."""
    model, state, answer = side.model, side.state, np.full(len(Answer._fields), 7.0)
    noticed = look.look(
        done, state.disc, state.load, state.weight, Listed(*state.listed), PairHistory(*history_of(state)), state.clumps,
        model.ring, 9.81, state.counters, answer, sight,
    )  # fmt: skip
    return Answer(*answer.tolist()), noticed


def test_a_look_computes_the_answer(window):
    model, state = window.model, window.state
    state.counters[1:] = 3, 4, 5
    sight = look.sight_of(window, 100)
    found, noticed = looked(window, sight)
    assert not noticed
    assert found == Answer(
        unbalanced_ratio(model, state, 9.81), 7.0, energy.kinetic(model, state), energy.stored(model, state), 12.5, 7.0, 5.0,
        energy.weight_height(model, state), 7.0,
    )  # fmt: skip
    assert found.kinetic > 0.0 < found.stored
    assert (sight.rows[0], sight.steps[0], sight.answers[0].tolist()) == (1, 40, list(found))


@pytest.mark.parametrize("bad", [np.nan, np.inf])
@pytest.mark.parametrize("where", ["load", "normal"])
def test_a_look_notices_forces_that_are_not_finite(window, bad, where):
    if where == "load":
        window.state.load[window.model.ring + 1, 0] = bad
    else:
        window.state.normal[0] = bad
    found, noticed = looked(window, look.sight_of(window, 100))
    assert noticed
    assert not np.isfinite(found.ratio)


def test_a_look_notices_a_disc_outside_the_ring_with_a_new_list(window):
    sight = look.sight_of(window, 100)
    window.state.x[window.model.ring + 3] = 0.75 + 3.0 * window.state.radius[0], 1.2
    assert not looked(window, sight)[1]  # it cannot have got there: the list of pairs is the old one
    rebuild(window.model, window.state)
    sight.fresh[0] = True
    assert looked(window, sight)[1]
    assert not sight.fresh[0]
    with pytest.raises(ArithmeticError, match="left the ring"):
        window.guard.refuse_lost(window.model, window.state)


def test_a_look_notices_a_ring_that_opens_until_it_was_warned_of(window):
    sight = look.sight_of(window, 100)
    window.state.x[: window.model.ring] *= 1.5
    assert looked(window, sight)[1]
    assert "the ring has opened" in window.guard.judge()
    assert not looked(window, sight)[1]
    assert window.guard.judge() == ""
