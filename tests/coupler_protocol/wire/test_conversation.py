"""The recorded conversation of the present version: each side alone says the recorded bytes and hears the recorded numbers."""

import pytest

from coupler_protocol.exits import PeerLost
from coupler_protocol.wire import frames, messages
from tests.coupler_protocol.wire import conversation as talk
from tests.coupler_protocol.wire import exchange


def against(transport, speak):
    first, second = talk.fixed()
    with first, second:
        return speak(transport)


def test_the_discrete_side_says_what_is_recorded_and_hears_every_bit():
    transport = talk.Against(talk.recorded(), 0)
    rim, field, go, heard, reason = against(transport, talk.speak_as_discs)
    assert transport.left == []
    assert rim.tobytes() == exchange.RIM.tobytes()
    assert field.tobytes() == exchange.FIELD.tobytes()
    assert go == {"gravity": 9.81, "step": 400, "time": 400.0, "stage": 2, "bin": talk.BIN}
    assert [order for order, _ in heard] == [talk.order(step) for step in range(1, talk.STEPS + 1)]
    assert [velocity.tobytes() for _, velocity in heard] == [talk.numbers(n, 4, 2).tobytes() for n in range(1, talk.STEPS + 1)]
    assert reason == "all stages done"


def test_the_continuum_says_what_is_recorded_and_hears_every_bit():
    transport = talk.StrangerFirst(talk.recorded())
    (mass, report), heard, farewell = against(transport, talk.speak_as_grid)
    assert transport.left == []
    assert mass.tolist() == [0.125] * 4
    assert report == talk.REPORT
    for step, (answer, force, sums, strain) in enumerate(heard):
        assert answer == messages.Answer(*talk.numbers(step, 8, 1)[:, 0])
        assert force.tobytes() == talk.numbers(step, 4, 2).tobytes()
        assert sums.tobytes() == talk.numbers(step, 4, 1).tobytes()
        assert strain.tobytes() == (talk.numbers(step - 1, talk.BINS, 3).tobytes() if step == 2 else b"")
    assert farewell == {"report": talk.REPORT, "stages": [exchange.TIMES]}


def test_the_record_is_complete():
    said = [messages.NAMES[frames.kind_of(frame)] for _, frame in talk.recorded()]
    assert set(said) == set(messages.NAMES[1:]) - {"REJECT", "FAILURE"}


def test_a_side_that_says_something_else_is_noticed():
    record = talk.recorded()
    place = next(i for i, (_, frame) in enumerate(record) if frames.kind_of(frame) == messages.READY)
    wrong = bytearray(record[place][1])
    wrong[-1] ^= 1
    record[place] = record[place][0], bytes(wrong)
    with pytest.raises(AssertionError):
        against(talk.Against(record, 0), talk.speak_as_discs)
    with pytest.raises(PeerLost, match="ended without a word"):
        against(talk.StrangerFirst(record), talk.speak_as_grid)
