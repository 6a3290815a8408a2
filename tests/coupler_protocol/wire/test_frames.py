"""Frames keep every bit, what was recorded once stays readable, and nothing else is believed."""

import random
import struct
import zlib
from pathlib import Path

import msgpack
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coupler_protocol.exits import PEER, PeerLost
from coupler_protocol.wire import frames as wire
from coupler_protocol.wire import messages
from tests.coupler_protocol.wire import exchange

RECORDED = Path(__file__).parent / "recorded"
BITS = st.integers(0, 2**64 - 1).map(lambda i: struct.unpack("<d", struct.pack("<Q", i))[0]).filter(np.isfinite)
AWKWARD = st.sampled_from([0.0, -0.0, 5e-324, -5e-324, 2.2e-308, 1.7976931348623157e308, 0.1])


def recorded(version=4):
    """{name: bytes} of a stored exchange."""
    text = (RECORDED / f"version{version}.txt").read_text(encoding="ascii")
    rows = (line.rpartition(": ") for line in text.splitlines() if line[0] != "#")
    return {name: bytes.fromhex(digits) for name, _, digits in rows}


def resealed(frame, offset, form, value):
    """The frame with one field of the header replaced and a checksum that fits."""
    frame = bytearray(frame)
    struct.pack_into(form, frame, offset, value)
    struct.pack_into("<I", frame, wire.CRC_AT, 0)
    struct.pack_into("<I", frame, wire.CRC_AT, zlib.crc32(frame))
    return frame


def control(kind, content):
    """A control frame with any content, for what our own code would not write."""
    frame = bytearray(wire.HEADER.size) + (content if isinstance(content, bytes) else msgpack.packb(content))
    return wire._seal(frame, kind, 1, 1, 0)


# -- the records ---------------------------------------------------------------------------------------------------------


def test_the_record_is_of_the_version_spoken_and_complete():
    assert messages.PROTOCOL_VERSION == 4
    assert set(recorded()) == {*messages.NAMES[1:], "FORCE again", "FORCE with strain", "GO with bin"}


def test_version_1_is_refused_by_its_number_and_differs_in_nothing_else():
    """What is new in version 2, strain with FORCE and bins with GO, came beside what version 1 said."""
    earlier = recorded(1)
    assert set(earlier) == set(recorded(2)) - {"FORCE with strain", "GO with bin"}
    for name, frame in earlier.items():
        with pytest.raises(wire.VersionError, match="protocol version 1, not 4"):
            wire.open_header(frame)
        assert resealed(frame, 4, "<H", 2) == recorded(2)[name]


def test_version_2_is_refused_by_its_number_and_differs_in_the_time_of_go_and_a_scalar_of_force():
    """New in bytes in version 3: the time in GO, the weight's height in FORCE; what else is new is what lengths of steps mean."""
    head, scalars = wire.HEADER.size, 7 * 8
    earlier = recorded(2)
    assert set(earlier) == set(recorded(3))
    for name, frame in earlier.items():
        with pytest.raises(wire.VersionError, match="protocol version 2, not 4"):
            wire.open_header(frame)
        if name in ("GO", "GO with bin"):
            now = wire.content_of(recorded(3)[name])
            assert msgpack.unpackb(frame[wire.HEADER.size :]) == {key: value for key, value in now.items() if key != "time"}
        elif name.startswith("FORCE"):
            now = recorded(3)[name]
            assert frame[head : head + scalars] == now[head : head + scalars]
            assert frame[head + scalars :] == now[head + scalars + 8 :]
        else:
            assert resealed(frame, 4, "<H", 3) == recorded(3)[name]


def test_version_3_is_refused_by_its_number_and_has_no_progress_moments_and_requests_to_stop():
    """New in bytes in version 4: PROGRESS, moments in HELLO and WELCOME, number of the run in WELCOME, and a scalar of FORCE."""
    head, scalars, earlier = wire.HEADER.size, 8 * 8, recorded(3)
    new = {"HELLO": {"checkpoints"}, "WELCOME": {"resume", "run"}}
    assert set(earlier) == set(recorded()) - {"PROGRESS"}
    for name, frame in earlier.items():
        with pytest.raises(wire.VersionError, match="protocol version 3, not 4"):
            wire.open_header(frame)
        if name in new:
            now = wire.content_of(recorded()[name])
            assert msgpack.unpackb(frame[head:]) == {key: value for key, value in now.items() if key not in new[name]}
        elif name.startswith("FORCE"):
            now = recorded()[name]
            assert frame[head : head + scalars] == now[head : head + scalars]
            assert frame[head + scalars :] == now[head + scalars + 8 :]
        else:
            assert resealed(frame, 4, "<H", 4) == recorded()[name]


@pytest.mark.parametrize("name", sorted(recorded()))
def test_todays_code_writes_the_recorded_bytes(name):
    assert exchange.written()[name].hex() == recorded()[name].hex()


def test_todays_code_reads_the_recorded_bytes():
    frames = recorded()
    for kind, session, sequence, content in exchange.CONTROL:
        frame = frames[messages.NAMES[kind]]
        assert wire.open_header(frame) == (kind, session, exchange.RANK, 0, sequence)
        assert wire.content_of(frame) == content
    for kind, scalars, values in exchange.STEPS:
        into = exchange.step_frame(kind, scalars, values)
        into.accept(frames[messages.NAMES[kind]])
        assert into.values.tobytes() == values.tobytes()
        assert into.scalars.tolist() == list(scalars)
    assert wire.open_header(frames["FORCE again"])[3] == wire.AGAIN
    into = exchange.step_frame(messages.FORCE, exchange.ANSWER, exchange.WITH_STRAIN)
    into.accept(frames["FORCE with strain"])
    assert into.values.tobytes() == exchange.WITH_STRAIN.tobytes()
    assert wire.content_of(frames["GO with bin"]) == exchange.GO_WITH_BIN


def test_what_a_message_may_hold_besides_has_its_type():
    with pytest.raises(wire.WireError, match="GO: bin is a str, not a float"):
        wire.content_of(control(messages.GO, exchange.GO_WITH_BIN | {"bin": "wide"}))


def test_header_stands_where_the_document_says():
    frame = recorded()["VELOCITY"]
    assert frame[:4] == b"CLVM"
    assert struct.unpack_from("<HH", frame, 4) == (4, messages.VELOCITY)
    assert struct.unpack_from("<Q", frame, 8) == (exchange.SESSION,)
    assert struct.unpack_from("<II", frame, 16) == (exchange.RANK, 0)
    assert struct.unpack_from("<Q", frame, 24) == (4711,)
    assert struct.unpack_from("<I", frame, 32) == (len(frame) - 40,)
    assert struct.unpack_from("<I", frame, 36) == (zlib.crc32(frame[:36] + b"\0\0\0\0" + frame[40:]),)


# -- bits ----------------------------------------------------------------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(st.lists(BITS | AWKWARD, min_size=1, max_size=20), st.integers(0, 2**64 - 1))
def test_a_step_message_keeps_every_bit(values, sequence):
    there, here = (wire.StepFrame(messages.FORCE, 3, 1, 1, len(values) - 1) for _ in range(2))
    there.scalars[:], there.values[:] = values[0], values[1:]
    frame = bytes(there.seal(sequence))
    assert wire.open_header(frame) == (messages.FORCE, 3, 1, 0, sequence)
    here.accept(memoryview(frame))
    assert np.r_[here.scalars, here.values].tobytes() == np.array(values).tobytes()


@settings(max_examples=40, deadline=None)
@given(st.lists(BITS | AWKWARD, max_size=12).filter(lambda v: len(v) % 2 == 0))
def test_an_array_in_a_control_message_keeps_every_bit(values):
    array = np.array(values, dtype=float).reshape(-1, 2)
    assert wire.unpack_array(wire.pack_array(array), columns=2, rows=len(array)).tobytes() == array.tobytes()


# -- what is refused -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda f: f[:39], "39 bytes is shorter than a header"),
        (lambda f: b"", "0 bytes is shorter"),
        (lambda f: b"XLVM" + f[4:], "not one of ours"),
        (lambda f: f[:-8], "announces 120 bytes and carries 112"),
        (lambda f: f + b"\0", "announces 120 bytes and carries 121"),
        (lambda f: f[:50] + bytes([f[50] ^ 1]) + f[51:], "checksum"),
        (lambda f: resealed(f, 4, "<H", 9), "protocol version 9, not 4"),
        (lambda f: resealed(f, 6, "<H", 0), "unknown kind of message 0"),
        (lambda f: resealed(f, 6, "<H", 14), "unknown kind of message 14"),
    ],
)
def test_a_header_that_does_not_fit_is_refused_in_words(change, words):
    frame = recorded()["VELOCITY"]
    with pytest.raises(wire.WireError, match=words):
        wire.open_header(change(frame))


def test_any_flipped_bit_is_noticed():
    frame = recorded()["FORCE"]
    for bit in random.Random(1).sample(range(8 * len(frame)), 200):
        wrong = bytearray(frame)
        wrong[bit // 8] ^= 1 << bit % 8
        with pytest.raises(wire.WireError):
            wire.open_header(wrong)


def test_a_step_message_of_another_length_is_refused():
    into = wire.StepFrame(messages.VELOCITY, exchange.SESSION, exchange.RANK, 7, 10)
    with pytest.raises(wire.WireError, match="VELOCITY has 160 bytes, 176 were agreed"):
        into.accept(recorded()["VELOCITY"])


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("place", ["scalars", "values"])
def test_a_number_that_is_not_finite_is_refused(value, place):
    frame = wire.StepFrame(messages.FORCE, 1, 1, 2, 4)
    getattr(frame, place)[1] = value
    with pytest.raises(wire.WireError, match="FORCE holds a number that is not finite"):
        wire.StepFrame(messages.FORCE, 1, 1, 2, 4).accept(bytes(frame.seal(0)))


GO = {"gravity": 9.81, "step": 1, "time": 1.0, "stage": 0}


@pytest.mark.parametrize(
    ("kind", "content", "words"),
    [
        (messages.GO, {k: v for k, v in GO.items() if k != "step"}, "GO: step is missing"),
        (messages.GO, GO | {"step": "1"}, "GO: step is a str, not a int"),
        (messages.GO, GO | {"step": 1.0}, "GO: step is a float, not a int"),
        (messages.GO, GO | {"step": True}, "GO: step is a bool"),
        (messages.GO, GO | {"stage": -1}, "GO: stage is negative"),
        (messages.GO, GO | {"gravity": float("nan")}, "GO holds a number that is not finite"),
        (messages.GO, [1, 2], "GO: the content is not a table"),
        (messages.GO, None, "GO: the content is not a table"),
        (messages.HELLO, {"package": "0", "float": "<f8", "scene": [1]}, "HELLO: scene is a list, not a dict"),
        (messages.READY, {"inner_mass": "abc", "report": {}}, "READY: inner_mass is a str, not a bytes"),
        (messages.FAREWELL, {"report": {}, "stages": [{"name": "a"}]}, r"FAREWELL: stages\[0\].computing is missing"),
        (messages.FAREWELL, {"report": {}, "stages": 3}, "FAREWELL: stages is not a list"),
        (messages.PACKED, {"a": {b"bytes": 1}}, "PACKED has a key that is not a text"),
        (messages.PACKED, {"a": msgpack.ExtType(5, b"")}, "PACKED holds a ExtType"),
        (messages.PACKED, {"a": msgpack.ExtType(5, b"x")}, "not valid msgpack"),
        (messages.PACKED, b"\xc1", "not valid msgpack"),
        (messages.PACKED, b"", "not valid msgpack"),
        (messages.PACKED, b"\x80\x80", "not valid msgpack"),
        (messages.PACKED, b"\x81\x01\x01", "not valid msgpack"),
        (messages.PACKED, b"\x81\xa1\xff\x01", "not valid msgpack"),
        (messages.PACKED, b"\x81\xa1a\xdd\xff\xff\xff\xff", "not valid msgpack"),
        (messages.PACKED, b"\x81\xa1a" + b"\x91" * 500 + b"\xc0", "nested too deeply"),
        (messages.PACKED, b"\x81\xa1a" + b"\x91" * 100_000 + b"\xc0", "not valid msgpack|nested too deeply"),
    ],
)  # fmt: skip
def test_a_malformed_content_is_refused_in_words(kind, content, words):
    with pytest.raises(wire.WireError, match=words) as found:
        wire.content_of(control(kind, content))
    assert isinstance(found.value, PeerLost)
    assert found.value.code == PEER


@settings(max_examples=150, deadline=None)
@given(st.sampled_from(sorted(messages.CONTENT)), st.binary(max_size=60))
def test_arbitrary_bytes_never_do_worse_than_be_refused(kind, content):
    try:
        found = wire.content_of(control(kind, content))
    except wire.WireError:
        return
    assert found.keys() >= messages.CONTENT[kind].keys()


def test_arrays_of_another_size_are_refused():
    with pytest.raises(wire.WireError, match="15 bytes"):
        wire.unpack_array(b"\0" * 15)
    with pytest.raises(wire.WireError, match="24 bytes"):
        wire.unpack_array(b"\0" * 24, columns=2)
    with pytest.raises(wire.WireError, match="32 bytes"):
        wire.unpack_array(b"\0" * 32, rows=5)
    with pytest.raises(wire.WireError, match="not finite"):
        wire.unpack_array(np.array([1.0, np.nan]).tobytes())


def test_a_message_too_long_for_any_peer_is_not_sent():
    with pytest.raises(ValueError, match=r"PACKED of .* bytes"):
        wire.control_frame(messages.PACKED, 1, 1, 0, {"a": b"\0" * wire.MAX_FRAME})
