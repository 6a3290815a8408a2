"""A line of a gate that admits everybody: the frames of who has not joined the run are read and bounded before ZeroMQ has them.

ZeroMQ bounds neither the parts of a message nor what all connections together may send. So until the continuum has sent this
connection a frame of its session (WELCOME is the first), a message has one part of at most MAX_FRAME bytes, and all such
connections of one machine together have an allowance of frames (of 64 KiB) a second. They are read more slowly once it is used
up, and a connection that sends more frames at once than are kept is closed. Framing: ZMTP 3.1 (RFC 37): 64 bytes of greeting,
then frames of flags (1: more parts follow, 2: long, 4: command), 1 or 8 bytes of length, content.
"""

import selectors
import socket
import time
from collections.abc import Callable, Iterator

from coupler_protocol.wire.byte_line import Line
from coupler_protocol.wire.frames import MAGIC

GREETING = 64  # bytes
MORE, LONG = 1, 2  # flags of a frame
PIECE = 1 << 12  # bytes of strangers that are read at once
UNIT = 1 << 16  # bytes that count as a frame
MAX_FRAME = 4 << 20  # bytes
SESSION, IN_SESSION = 8, 16  # first byte of the session in a frame of ours, and the one after it


class Allowance:
    """Units that come at a rate [1/s] and are used up; no more than `most` are kept."""

    def __init__(self, rate: float, most: float) -> None:
        self.rate, self.most = rate, most
        self._left, self._at = most, time.monotonic()

    def left(self, now: float) -> float:
        """What is left; negative after more than that was used."""
        self._left = min(self.most, self._left + self.rate * (now - self._at))
        self._at = now
        return self._left

    def use(self, count: float) -> None:
        """Takes away."""
        self._left -= count


class UnfitError(OSError):
    """A frame that a stranger may not send."""


class FrameHeads:
    """Reads the heads of ZMTP frames from pieces of a stream."""

    def __init__(self) -> None:
        self._skip = GREETING  # bytes up to the next head
        self._head = bytearray()  # of the frame whose length is not known yet
        self._begin: bytearray | None = None  # first IN_SESSION bytes of the frame
        self._size = 0

    def feed(self, data: bytes) -> Iterator[tuple[int, int, bytes]]:
        """(flags, length, first bytes of the content) of the frames whose first bytes are in the next piece of the stream."""
        at = 0
        while at < len(data) or (self._begin is not None and not self._wanted()):
            if self._begin is not None:
                taken = data[at : at + self._wanted()]
                self._begin += taken
                at += len(taken)
                if not self._wanted():
                    begin, self._begin = bytes(self._begin), None
                    self._skip = self._size - len(begin)
                    yield self._head[0], self._size, begin
                    self._head.clear()
            elif self._skip:
                step = min(self._skip, len(data) - at)
                self._skip -= step
                at += step
            else:
                self._head.append(data[at])
                at += 1
                if len(self._head) == (9 if self._head[0] & LONG else 2):
                    self._size, self._begin = int.from_bytes(self._head[1:], "big"), bytearray()

    def _wanted(self) -> int:
        """Bytes of the content that are still to be seen."""
        return 0 if self._begin is None else min(IN_SESSION, self._size) - len(self._begin)


def session_in(begin: bytes) -> bytes:
    """Session, as bytes, of a frame of ours that begins so; empty without one."""
    session = begin[SESSION:IN_SESSION]
    return session if begin.startswith(MAGIC) and any(session) else b""


class JoiningLine(Line):
    """A Line of the discrete side to a gate for everybody; joined(session): called once, with the session that it hears first."""

    def __init__(
        self, selector: selectors.BaseSelector, outside: socket.socket, inside: socket.socket, joined: Callable[[bytes], object]
    ) -> None:
        self._joined: Callable[[bytes], object] | None = joined
        self._heads = FrameHeads()
        super().__init__(selector, outside, inside)

    @property
    def unread(self) -> bool:
        """Whether it has heard its session."""
        return self._joined is None

    def _passed(self, data: bytes, end: socket.socket) -> bytes:
        if self._joined is not None and end is self.outside:
            for _, _, begin in self._heads.feed(data):
                if self._joined is not None and (session := session_in(begin)):
                    self._joined(session)
                    self._joined = None
        return data


class StrangerLine(Line):
    """A Line whose outside end is bounded until it has joined the run; allowance: of frames, of all such lines of a machine.

    session: what the continuum has told it, until the gate has taken note.
    """

    def __init__(
        self, selector: selectors.BaseSelector, outside: socket.socket, inside: socket.socket, allowance: Allowance
    ) -> None:
        self.joined, self.fault, self.session = False, "", b""
        self._allowance, self._paused = allowance, False
        self._heads = {outside: FrameHeads(), inside: FrameHeads()}
        super().__init__(selector, outside, inside)
        self.piece = PIECE

    @property
    def unread(self) -> bool:
        """Whether it has joined the run and the gate has taken note of its session."""
        return self.joined and not self.session

    def go_on(self, now: float) -> bool:
        """Reads on if the allowance lets it; returns whether it does not."""
        if self._paused and (self.joined or self._allowance.left(now) >= 1.0):
            self._paused = False
            self._listen(self.outside)
        return self._paused

    def _reads(self, end: socket.socket) -> bool:
        return super()._reads(end) and not (self._paused and end is self.outside)

    def _passed(self, data: bytes, end: socket.socket) -> bytes:
        if self.joined:
            return data
        count = 0
        for flags, size, begin in self._heads[end].feed(data):
            count += 1
            if end is self.inside:
                if session := session_in(begin):
                    self.joined, self.session = True, session
            elif flags & MORE:
                self.fault = "it sent a message of several parts"
            elif size > MAX_FRAME:
                self.fault = f"it announced a frame of {size} bytes, {MAX_FRAME} are allowed"
        if end is self.outside and count > self._allowance.most:
            self.fault = f"it sent {count} frames at once before it joined the run"
        if self.fault:
            raise UnfitError(self.fault)
        if end is self.outside:
            self._allowance.use(count + len(data) / UNIT)
            self._paused = self._allowance.left(time.monotonic()) < 0.0
        return data
