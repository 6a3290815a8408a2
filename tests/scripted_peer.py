"""The other side of a conversation, which says exactly what a test tells it to, and a transport that loses what it carries."""

import random
import threading
from typing import NamedTuple

from coupler_protocol.process.interrupt import StopRequest
from coupler_protocol.scene.scene import Link
from coupler_protocol.wire import frames, link_inproc
from coupler_protocol.wire.clocks import Clocks
from coupler_protocol.wire.lockstep import Conversation, Hub

SESSION = 7


def clocks(timeout=0.1, give_up=0.4, **more):
    """Short clocks; more: other keys of [link]."""
    return Clocks(Link(**{"timeout": timeout, "give_up": give_up, "arrival": 4.0, "step": 4.0, "farewell": 4.0} | more))


class Heard(NamedTuple):
    kind: int
    session: int
    rank: int
    flags: int
    sequence: int
    frame: bytes

    @property
    def content(self):
        return frames.content_of(self.frame)


class Peer:
    """Speaks over one end of a link; `to` is whom its transport sends to."""

    def __init__(self, transport, to, rank=1, session=SESSION):
        self.transport, self.to, self.rank, self.session = transport, to, rank, session

    def send_control(self, kind, sequence, content=None, again=False, **header):
        """Send a control message; `header` replaces rank or session."""
        about = {"session": self.session, "rank": self.rank} | header
        frame = frames.control_frame(kind, about["session"], about["rank"], sequence, content or {})
        return self.send(frames.sent_again(frame) if again else frame)

    def send(self, frame):
        """Send any bytes; returns them."""
        self.transport.send(frame, self.to)
        return bytes(frame)

    def receive(self, seconds=2.0):
        """The next frame, or None after silence."""
        received = self.transport.receive(seconds)
        return received and Heard(*frames.open_header(received[1]), bytes(received[1]))


class Lossy:
    """A transport whose frames are sometimes lost, doubled or corrupted on their way out."""

    def __init__(self, transport, seed, rate=0.05):
        self.inner, self.random, self.rate, self.faults = transport, random.Random(seed), rate, 0

    def send(self, frame, rank=0):
        chance = self.random.random()
        self.faults += chance < 3 * self.rate
        if chance < self.rate:
            return
        if chance < 2 * self.rate:
            self.inner.send(frame, rank)
        elif chance < 3 * self.rate:
            frame = bytearray(frame)
            frame[self.random.randrange(len(frame))] ^= 1 << self.random.randrange(8)
        self.inner.send(frame, rank)

    def __getattr__(self, name):
        return getattr(self.inner, name)


def discrete_side(**times):
    """A discrete side's conversation, in the middle of a session, and a scripted continuum."""
    hub, ends = link_inproc.transports(1)
    talk = Conversation(ends[0], 1, 0, clocks(**times), StopRequest())
    talk.begin(SESSION)
    return talk, Peer(hub, "thread 1")


def hub_side(n_ranks=1, **times):
    """A continuum's hub, in the middle of a session, and scripted discrete processes."""
    transport, ends = link_inproc.transports(n_ranks)
    hub = Hub(transport, range(1, n_ranks + 1), clocks(**times), StopRequest())
    for rank in hub.conversations:
        transport.admit(f"thread {rank}", rank)
        hub.conversations[rank].begin(SESSION)
    return hub, [Peer(end, 0, rank) for rank, end in enumerate(ends, start=1)]


class Beside:
    """Runs a function in a thread for the length of a `with` block and hands on its exception."""

    def __init__(self, work):
        self.error = self.result = None
        self._work, self._thread = work, threading.Thread(target=self._run, daemon=True)

    def _run(self):
        try:
            self.result = self._work()
        except BaseException as error:
            self.error = error

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, kind, *_):
        self._thread.join(20.0)
        assert not self._thread.is_alive(), "the thread beside the test hangs"
        if self.error is not None and kind is None:
            raise self.error
