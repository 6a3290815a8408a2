"""The way of a discrete process to the gate of a continuum (gate.py): proves itself there, then passes the bytes of ZeroMQ on.

ZeroMQ connects to a Unix socket in a folder of this user; for each of its connections, this thread makes one to the continuum.
If that fails, ZeroMQ's connection is closed as well, and ZeroMQ tries again.
"""

import contextlib
import logging
import secrets
import selectors
import socket
import time
from collections.abc import Iterable
from typing import Any

from coupler_protocol.wire import gate_words as words
from coupler_protocol.wire.admission import Pass
from coupler_protocol.wire.attendant import Attendant
from coupler_protocol.wire.byte_line import Line
from coupler_protocol.wire.stranger_line import JoiningLine

log = logging.getLogger(__name__)
PATIENCE = 2.0  # [s] for the gate to be reached, and for each of its answers


class RefusedError(Exception):
    """A refusal that trying again does not change; the text says what to do. proved: the continuum itself has refused."""

    def __init__(self, text: str, proved: bool = False) -> None:
        super().__init__(text)
        self.proved = proved


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
            elif key.data is not None and key.data[0].open:
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
                outside = self._through()
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
        text = str(error) if isinstance(error, RefusedError) else self._trouble(error)
        if getattr(error, "proved", False) or (isinstance(error, RefusedError | words.ForeignError) and not self.passed):
            self.refused = text
        if text != self.trouble:
            self.trouble = text
            log.warning("%s", text)

    def _trouble(self, error: Exception) -> str:
        where = self.endpoint
        if isinstance(error, words.ForeignError):
            return f"the program at {where} is not a continuum of this version: {error}; check address and version"
        if isinstance(error, ConnectionRefusedError):
            return f"no program listens at {where}: check that the continuum was started, the address, and the firewall"
        if isinstance(error, TimeoutError):
            return f"the machine or program at {where} does not answer: check the address and the firewall"
        return f"no connection with {where}: {getattr(error, 'strerror', None) or error}"

    # -- at the gate -------------------------------------------------------------------------------------------------

    def _through(self) -> socket.socket:
        """A connection that has passed the gate; raises OSError, ForeignError, RefusedError."""
        connection = socket.create_connection(self.address, PATIENCE)
        try:
            heard = _exactly(connection, words.GREETING.size)
            kind, number = words.read_greeting(heard)
            own = self.ticket
            said = words.claim(heard, own.kind, own.number, own.public, secrets.token_bytes(words.NONCE), own.secret)
            connection.sendall(said)
            if kind != own.kind:
                raise RefusedError(self._other_kind(kind))
            if number != own.number:
                raise RefusedError(
                    f"the continuum at {self.endpoint} has another key than {own.where} expects: the address is wrong, "
                    f"another program has taken its port, or its keys were made again (then make a new key for this machine)"
                )
            verdict, proved = words.read_verdict(_exactly(connection, words.VERDICT.size), heard, said, own.secret)
            if verdict != words.WELCOME:
                raise RefusedError(self._refusal(verdict), proved) if verdict != words.FULL else OSError(self._refusal(verdict))
            if not proved:
                raise RefusedError(
                    f"the program at {self.endpoint} does not know the secret of this side: it is not the continuum"
                )
        except BaseException:
            connection.close()
            raise
        return connection

    def _other_kind(self, kind: int) -> str:
        where, own = self.endpoint, self.ticket.kind
        if kind == words.KEYED:
            return f"the continuum at {where} takes clients with a key only: name the key file of this machine with --key FILE"
        if own == words.KEYED:
            return f"the continuum at {where} was started without keys: start it with --keys, or this side without --key"
        if kind == words.OPEN:
            return f"the continuum at {where} was started with --insecure: start this side with --insecure as well"
        return f"the continuum at {where} takes processes of its own user only: start both sides without --insecure, or with keys"

    def _refusal(self, verdict: int) -> str:
        """Why the continuum refused this process, in words."""
        keys, where = self.ticket.curve, self.endpoint
        key = f"the key {keys.name!r} of {self.ticket.where}" if keys else "this process"
        return {
            words.UNKNOWN: f"the continuum at {where} does not know {key}: make a key there with `colluvium keys new NAME`",
            words.REVOKED: f"the continuum at {where} has revoked {key}: ask its user for a new one",
            words.UNPROVED: f"the continuum at {where} refused {key}: it has another secret. "
            + ("Copy the key file again" if keys else "The continuum belongs to another user of this machine: use keys"),
            words.FULL: f"the continuum at {where} has too many connections",
        }.get(verdict, f"the continuum at {where} refused {key}")


def _exactly(connection: socket.socket, size: int) -> bytes:
    """The next `size` bytes; raises ForeignError if their begin is foreign, OSError if they do not come in time."""
    found = b""
    until = time.monotonic() + PATIENCE
    while len(found) < size:
        part = connection.recv(size - len(found))
        if time.monotonic() > until:
            raise TimeoutError
        if not part:
            raise ConnectionError("it closed the connection")
        found += part
        if not words.MAGIC.startswith(found[: len(words.MAGIC)]):
            raise words.ForeignError(words.FOREIGN)
    return found
