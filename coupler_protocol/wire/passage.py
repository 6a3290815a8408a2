"""The way of a discrete process to the gate of a continuum (gate.py): proves itself there, then passes the bytes of ZeroMQ on.

ZeroMQ connects to a Unix socket in a folder of this user; for each of its connections, this thread makes one to the continuum.
If that fails, ZeroMQ's connection is closed as well, and ZeroMQ tries again.
"""

import contextlib
import logging
import selectors
import socket
import time
from collections.abc import Iterable
from typing import Any

from coupler_protocol.wire import gate_words as words
from coupler_protocol.wire import passing
from coupler_protocol.wire.admission import Pass
from coupler_protocol.wire.attendant import Attendant
from coupler_protocol.wire.byte_line import Line
from coupler_protocol.wire.passing import RefusedError
from coupler_protocol.wire.stranger_line import JoiningLine

log = logging.getLogger(__name__)


class Passage(Attendant):
    """Listens on the Unix socket `listener` and connects each connection with the gate at (host, port); endpoint: its name.

    trouble: why there is no connection, or ""; refused: that text if trying again does not help. Once there was a connection,
    only the continuum itself can refuse: another program may have taken its port for a while.
    """

    def __init__(self, listener: socket.socket, address: tuple[str, int], endpoint: str, ticket: Pass) -> None:
        super().__init__("passage")
        self.listener, self.address, self.endpoint, self.ticket = listener, address, endpoint, ticket
        self.trouble = self.refused = ""
        self.passed = False  # whether there ever was a connection
        self._line: Line | None = None
        listener.setblocking(False)
        self._selector.register(listener, selectors.EVENT_READ, None)
        self.thread.start()

    def _busy(self) -> bool:
        return self._line is not None and self._line.open

    def _connections(self) -> Iterable[Any]:
        return (self.listener,) if self._line is None else (self._line, self.listener)

    def _serve(self, seconds: float) -> None:
        for key, events in self._selector.select(seconds):
            if key.fileobj is self.listener:
                self._begin()
            elif key.data is not None:
                key.data[0].serve(key.data[1], events)
        if self._line is not None and self._line.deadline is not None and time.monotonic() > self._line.deadline:
            self._line.close()

    def _begin(self) -> None:
        """Takes a connection of ZeroMQ and makes its counterpart."""
        with contextlib.suppress(BlockingIOError, ConnectionError):
            inside = self.listener.accept()[0]
            if self._line is not None:
                self._line.close()
            try:
                outside = passing.through(self.address, self.endpoint, self.ticket).connection
            except (OSError, RefusedError, words.ForeignError) as error:
                inside.close()
                self._note(error)
                return
            if self.ticket.kind == words.OPEN:
                self._line = JoiningLine(self._selector, outside, inside, self._keep_session)
            else:
                self._line = Line(self._selector, outside, inside)
            self.passed, self.trouble = True, ""

    def _keep_session(self, session: bytes) -> None:
        """By the session of its run, this process is no stranger when it comes back."""
        self.ticket = self.ticket._replace(secret=session)

    def _note(self, error: Exception) -> None:
        """Stores why there is no connection, and logs it where it is new."""
        text = passing.trouble(error, self.endpoint)
        if getattr(error, "proved", False) or (isinstance(error, RefusedError | words.ForeignError) and not self.passed):
            self.refused = text
        if text != self.trouble:
            self.trouble = text
            log.warning("%s", text)
