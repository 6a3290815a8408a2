"""A whole conversation with fixed content between both sides, as a file, and each side alone against the file.

    python -m tests.coupler_protocol.wire.conversation

writes recorded/conversationN.bin of the present protocol version N, if it does not exist: for each frame a byte (0: of the
discrete side, 1: of the continuum), its length (uint32, little-endian) and its bytes. A recorded conversation never changes.
"""

import struct
import threading
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

import numpy as np

from coupler_protocol.process.interrupt import StopRequest
from coupler_protocol.scene.scene import Link
from coupler_protocol.wire import frames, link_inproc, messages, payloads
from coupler_protocol.wire.clocks import Clocks
from coupler_protocol.wire.handshake import join, welcome_all
from coupler_protocol.wire.lockstep import Conversation, Hub
from dem_server.coupling.grid_talk import GridTalk
from fdm_server.coupling.window_talk import WindowTalk
from tests.coupler_protocol.wire import exchange

RECORDED = Path(__file__).parent / "recorded" / f"conversation{messages.PROTOCOL_VERSION}.bin"
ITEM = struct.Struct("<BI")
SCENE = SimpleNamespace(
    link=Link(lane=False), coupling=SimpleNamespace(exchange_every=1), resolved=lambda: {"seed": 1, "title": "Böschung"}
)
REPORT = {"discs": 749, "porosity": 0.16}
BIN, BINS = 0.5, 1  # length of bins for strain [m], number of them in the rim
STEPS = 4


def numbers(step, rows, columns):
    """Fixed numbers of a step, of all magnitudes."""
    return np.random.default_rng(step).standard_normal((rows, columns)) * 10.0 ** np.arange(-150, -150 + 90 * columns, 90)


def order(step):
    flags = messages.RECORD | messages.STRAIN if step == 2 else messages.END_OF_STAGE if step == STEPS else 0
    return messages.Order(2.0, 400.0 + step, 9.81, 1.0, 1.0, 1.0, float(flags))


def speak_as_discs(transport):
    """The discrete side; returns what it received."""
    talk = Conversation(transport, 1, 0, Clocks(SCENE.link), StopRequest())
    rim = join(talk, SCENE).rim
    talk.notify(messages.PROGRESS, {"doing": "discs come to rest 35 %"})
    talk.send_control(messages.PACKED, REPORT)
    field = payloads.field_of(frames.content_of(talk.receive((messages.FIELD,))[1]))
    talk.send_control(messages.READY, payloads.ready_content(np.full(len(rim), 0.125), REPORT))
    go = frames.content_of(talk.receive((messages.GO,))[1])
    heard, steps, strain = [], GridTalk(talk, len(rim), BINS), None
    while True:
        step = len(heard)
        steps.send_forces(numbers(step, 4, 2), numbers(step, 4, 1)[:, 0], messages.Answer(*numbers(step, 8, 1)[:, 0]), strain)
        found, reason = steps.receive_order()
        if found is None:
            talk.send_control(messages.FAREWELL, {"report": REPORT, "stages": [exchange.TIMES]})
            return rim, field, go, heard, reason
        heard.append((found, steps.velocity.copy()))
        strain = numbers(step, BINS, 3) if int(found.flags) & messages.STRAIN else None


def speak_as_grid(transport):
    """The continuum; returns what it received."""
    hub = Hub(transport, [1], Clocks(SCENE.link), StopRequest())
    welcome_all(hub, SCENE, {1: exchange.RIM})
    talk = WindowTalk(hub.conversations[1], "band", exchange.RIM)
    talk.receive_packed()
    hub.conversations[1].notify(messages.PROGRESS, {"doing": "equilibrium: step 200"})
    talk.send_field(exchange.FIELD, 9.81, True)
    ready, heard = talk.receive_ready(), []
    talk.send_go(9.81, 400, 400.0, 2, BIN)
    for step in range(1, STEPS + 1):
        found = talk.receive_forces()
        heard.append((found.answer, found.force.copy(), found.sums.copy(), found.strain.copy()))
        talk.send_velocities(numbers(step, 4, 2), order(step))
    return ready, heard, talk.send_stop("all stages done")


class Tap:
    """A transport that notes what is sent, in one list for both sides."""

    def __init__(self, inner, side, record):
        self._inner, self._side, self._record = inner, side, record

    def send(self, frame, rank=0):
        self._record.append((self._side, bytes(frame)))
        self._inner.send(frame, rank)

    def __getattr__(self, name):
        return getattr(self._inner, name)


class Against:
    """A transport whose other end is a record: it expects the recorded frames of its own side, and hands out the others."""

    lanes, local, port, endpoint = None, True, 0, "a record"
    proves, trouble = True, ""

    def __init__(self, record, side):
        self.left, self._side = list(record), side

    def send(self, frame, rank=0):
        side, expected = self.left.pop(0)
        assert side == self._side, "the other side is recorded to speak now"
        assert bytes(frame).hex() == expected.hex()

    def receive(self, seconds):
        if not self.left or self.left[0][0] == self._side:
            return None
        return self._side and 1, memoryview(self.left.pop(0)[1])

    def admit(self, sender, rank):
        pass

    def connected(self, rank=0):
        return True

    def departed(self, rank=0):
        return not self.left or self.left[0][0] == self._side  # the record waits for this side, which must not wait


class StrangerFirst(Against):
    """As Against, of the continuum: HELLO comes from a sender without rank."""

    def __init__(self, record):
        super().__init__(record, 1)
        self._admitted = False

    def receive(self, seconds):
        found = super().receive(seconds)
        return found and (found[0] if self._admitted else "new", found[1])

    def admit(self, sender, rank):
        self._admitted = True


def fixed():
    """While this lasts, session, number of the run and version of the package are fixed."""
    package = mock.patch("coupler_protocol.wire.handshake.version", return_value="0.2.0")
    return package, mock.patch(
        "coupler_protocol.wire.handshake.secrets.randbits", side_effect=lambda bits: exchange.SESSION % (1 << bits)
    )


def recorded(path=RECORDED):
    """List of (side, frame) of a file."""
    data, at, found = path.read_bytes(), 0, []
    while at < len(data):
        side, size = ITEM.unpack_from(data, at)
        found.append((side, data[at + ITEM.size : at + ITEM.size + size]))
        at += ITEM.size + size
    return found


def conversation():
    """List of (side, frame) as both sides say them now."""
    record, (hub, (end,)) = [], link_inproc.transports(1)
    first, second = fixed()
    with first, second:
        discs = threading.Thread(target=speak_as_discs, args=(Tap(end, 0, record),))
        discs.start()
        speak_as_grid(Tap(hub, 1, record))
        discs.join()
    return record


if __name__ == "__main__":
    with RECORDED.open("xb") as file:
        file.writelines(ITEM.pack(side, len(frame)) + frame for side, frame in conversation())
