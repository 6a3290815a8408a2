"""A line: two connected sockets, of which each gets what the other one says, in order and unchanged.

A line holds at most one piece of PIECE bytes for each end: it reads no more from one end before the other has taken that. The
thread of its selector serves it; once nobody needs to read what it passes on, a compiled loop does (pumping.py).
"""

import contextlib
import selectors
import socket
import time

from coupler_protocol.wire import pumping

PIECE = 1 << 16  # bytes read at once; a pump has room for as many
LINGER = 0.5  # [s] for the other direction once one end has said all


class Line:
    """Two sockets, outside and inside; the events of both come from a selector, whose data are (line, socket)."""

    def __init__(self, selector: selectors.BaseSelector, outside: socket.socket, inside: socket.socket) -> None:
        self.selector, self.outside, self.inside = selector, outside, inside
        self.open = True
        self.piece = PIECE
        self.deadline: float | None = None  # time at which it is closed, once one end has said all
        self._pending = {outside: b"", inside: b""}  # what each end still has to be sent
        self._said_all = {outside: False, inside: False}
        self._events = {outside: 0, inside: 0}
        self._pump: pumping.PumpThread | None = None
        for end in (outside, inside):
            end.setblocking(False)
            if end.family != socket.AF_UNIX:
                end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._listen(end)

    @property
    def unread(self) -> bool:
        """Whether nobody needs to read what it passes on."""
        return True

    def serve(self, end: socket.socket, events: int) -> None:
        """Moves what can be moved after an event of one end; closes the line if it has ended."""
        if not self.open or self._pump is not None:
            return
        other = self.inside if end is self.outside else self.outside
        try:
            if events & selectors.EVENT_WRITE:
                self._send(end)
            if events & selectors.EVENT_READ and not self._pending[other] and not self._said_all[end]:
                self._read(end, other)
        except OSError:
            self.close()
            return
        if all(self._said_all.values()):
            self.close()
        elif self.open:
            self._listen(end)
            self._listen(other)
            if self.unread and self.deadline is None and pumping.ready():
                self._hand_over()

    def _hand_over(self) -> None:
        """Leaves both ends to a pump, if the system has one more thread."""
        one, other = ends = self.outside, self.inside
        for end in ends:
            self._ask(end, 0)
        try:
            self._pump = pumping.PumpThread(ends, (self._pending[one], self._pending[other]), LINGER, self._note_end)
        except RuntimeError:
            for end in ends:
                self._listen(end)

    def _note_end(self) -> None:
        self.open = False

    def _read(self, end: socket.socket, other: socket.socket) -> None:
        try:
            data = end.recv(self.piece)
        except BlockingIOError:
            return
        if data:
            self._pending[other] = self._passed(data, end)
            self._send(other)
        else:
            self._said_all[end] = True
            self.deadline = time.monotonic() + LINGER
            with contextlib.suppress(OSError):
                other.shutdown(socket.SHUT_WR)

    def _passed(self, data: bytes, end: socket.socket) -> bytes:
        """What of the data of an end is passed on; all of it here."""
        return data

    def _send(self, end: socket.socket) -> None:
        if self._pending[end]:
            with contextlib.suppress(BlockingIOError):
                sent = end.send(self._pending[end])
                self._pending[end] = self._pending[end][sent:]

    def _reads(self, end: socket.socket) -> bool:
        """Whether this end is to be read."""
        other = self.inside if end is self.outside else self.outside
        return not self._said_all[end] and not self._pending[other]

    def _listen(self, end: socket.socket) -> None:
        """Asks the selector for the events that are of use now."""
        if self._pump is None:
            self._ask(end, selectors.EVENT_READ * self._reads(end) | selectors.EVENT_WRITE * bool(self._pending[end]))

    def _ask(self, end: socket.socket, events: int) -> None:
        """Asks the selector for these events."""
        if events == self._events[end]:
            return
        if not events:
            self.selector.unregister(end)
        elif self._events[end]:
            self.selector.modify(end, events, (self, end))
        else:
            self.selector.register(end, events, (self, end))
        self._events[end] = events

    def close(self) -> None:
        """Closes both sockets."""
        if self._pump is not None:
            self._pump.stop()
        elif self.open:
            self.open = False
            for end in (self.outside, self.inside):
                self._ask(end, 0)
                end.close()
