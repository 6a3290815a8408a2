"""Faults on the lane while plain steps are taken: they cost time and perhaps the lane, and the results keep their bits."""

import copy
import json
import re
import zlib

import numpy as np
import pytest

from colluvium.running.threads import run
from coupler_protocol.exits import PeerLost
from coupler_protocol.files.restart import Origin
from coupler_protocol.scene.reader import build_scene
from coupler_protocol.wire import lanes, link_inproc, messages
from coupler_protocol.wire.frames import CRC_AT, HEADER
from tests.integration.meddled_lane import CLOSE, Meddler
from tests.integration.test_plain_steps import CASES, SHORT, scene
from tests.same_bits import differing

STEPS = 130  # of the stage that is computed again and again
TIMEOUT = 0.4  # [s]
SIDES = ("fdm.rank0", "dem.rank1")


@pytest.fixture(autouse=True)
def _from_the_first_step(monkeypatch):
    """Plain steps begin at once, not only in long runs."""
    monkeypatch.setattr(lanes, "EARLIEST", 0)


@pytest.fixture(scope="module")
def data():
    """Tables of the scene of test_plain_steps.py whose kernels its tests compile."""
    return scene(link__timeout=TIMEOUT, **CASES[SHORT])


@pytest.fixture(scope="module")
def straight(data, tmp_path_factory):
    """The run over the link alone; its last stage once more with plain steps, so that they are compiled."""
    out = tmp_path_factory.mktemp("link")
    own = copy.deepcopy(data)
    own["link"] = {"lane": False}
    run(build_scene(own), out)
    own["link"] = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(lanes, "EARLIEST", 0)
        run(build_scene(own), tmp_path_factory.mktemp("lane"), origin=Origin(out, "couple"))
    return out


def last_stage(data, straight, out, monkeypatch, meddler):
    """The last stage once more, with a meddler on its lane; its row of run.json."""
    monkeypatch.setattr(link_inproc, "Hatch", meddler.hatch)
    run(build_scene(data), out, origin=Origin(straight, "couple"))
    meddler.join()
    return json.loads((out / "run.json").read_text())["stages"][-1]


def flipped(frame, byte):
    """The frame with one other bit."""
    return frame[:byte] + bytes([frame[byte] ^ 16]) + frame[byte + 1 :]


def of_another_session(frame):
    """A valid frame of a run that is not this one."""
    found = bytearray(frame)
    found[8:16] = b"stranger"
    return with_right_checksum(found)


def with_right_checksum(frame):
    found = bytearray(frame)
    found[CRC_AT : HEADER.size] = bytes(4)
    found[CRC_AT : HEADER.size] = zlib.crc32(found).to_bytes(4, "little")
    return bytes(found)


FAULTS = {  # name: (treatment of a frame, whether the lane stays; None: as it is seen first on the link or on the lane)
    "late": (lambda frame, last: [0.3 * TIMEOUT, frame], True),
    "doubled": (lambda frame, last: [frame, frame], True),
    "after an old one": (lambda frame, last: [last, frame], True),
    "in two pieces": (lambda frame, last: [frame[:99], 0.3 * TIMEOUT, frame[99:]], True),
    "lost": (lambda frame, last: [], False),
    "too late": (lambda frame, last: [2.5 * TIMEOUT, frame], None),
    "half, the rest too late": (lambda frame, last: [frame[:99], 2.5 * TIMEOUT, frame[99:]], None),
    "half, then the end": (lambda frame, last: [frame[:99], CLOSE], False),
    "the end": (lambda frame, last: [CLOSE], False),
    "a flipped bit of a number": (lambda frame, last: [flipped(frame, 99)], False),
    "a flipped bit of the sequence": (lambda frame, last: [flipped(frame, 24)], False),
    "a flipped bit of the kind": (lambda frame, last: [flipped(frame, 6)], False),
    "foreign bytes before it": (lambda frame, last: [b"GET / HTTP/1.1\r\n\r\n", frame], False),
    "a frame of another session before it": (lambda frame, last: [of_another_session(frame), frame], False),
    "a frame of foreign bytes before it": (lambda frame, last: [b"x" * len(frame), frame], False),
}
KINDS = {"FORCE": messages.FORCE, "VELOCITY": messages.VELOCITY}
SHORT_ONES = {
    "FORCE": ("after an old one", "lost", "half, then the end", "a flipped bit of a number"),
    "VELOCITY": ("doubled", "half, the rest too late", "foreign bytes before it", "the end"),
}
ALL = [
    pytest.param(kind, fault, marks=() if fault in SHORT_ONES[kind] else pytest.mark.long) for kind in KINDS for fault in FAULTS
]


@pytest.mark.parametrize(("kind", "fault"), ALL)
def test_a_fault_on_the_lane_changes_no_bit(data, straight, tmp_path, monkeypatch, caplog, kind, fault):
    treat, stays = FAULTS[fault]
    at = 44 + list(FAULTS).index(fault)  # also in steps after which histories have a point
    meddler = Meddler(KINDS[kind], at, treat)
    row = last_stage(data, straight, tmp_path, monkeypatch, meddler)
    assert meddler.done == 1
    for side in SIDES:
        assert differing(straight / f"{side}.more.h5", tmp_path / f"{side}.more.h5") == []
    told = "the lane" in caplog.text
    assert stays is None or told != stays, caplog.text
    if not told:
        assert row["plain_steps"] >= 0.8 * STEPS
        assert "one_by_one" not in row
    else:
        assert at - 8 < row["plain_steps"] < at
        assert row["one_by_one"] == "the lane was closed"


@pytest.mark.parametrize("kind", KINDS)
def test_a_number_that_is_not_finite_ends_the_run_as_the_fault_of_its_sender(data, straight, tmp_path, monkeypatch, kind):
    def treat(frame, last):
        return [with_right_checksum(frame[:-8] + np.float64("nan").tobytes())]

    with pytest.raises(PeerLost, match=re.compile(f"{kind} holds a number that is not finite")):
        last_stage(data, straight, tmp_path, monkeypatch, Meddler(KINDS[kind], 47, treat))
    assert json.loads((tmp_path / "run.json").read_text())["exit_code"] == 5
    assert all((tmp_path / f"{side}.stopped.h5").exists() for side in SIDES)
