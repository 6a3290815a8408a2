"""The gate of a continuum: the only socket that others can reach, in front of ZeroMQ (docs/design/0014-the-gate.md).

A connection first proves that it may come in (gate_words.py, admission.py): with a fixed number of bytes, within PATIENCE
seconds, and no more than WAITING connections at a time; of too many, the oldest of the busiest address goes. Only then are its
bytes passed on to ZeroMQ, which listens on a Unix socket in a folder of this user. A gate that admits everybody (--insecure) also
reads and bounds the frames of those who have not joined the run (stranger_line.py).

One thread serves everything that strangers can cause, which is a bounded amount of work: ACCEPTS connections a second. The bytes
of a process that has joined the run are passed on by a thread of their own, in a compiled loop (pumping.py).
"""

import contextlib
import logging
import secrets
import selectors
import socket
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple, TypeVar

from coupler_protocol.exits import EnvironmentFailed
from coupler_protocol.wire import gate_words as words
from coupler_protocol.wire.admission import JOINED, Judged, Rule, SecretRule
from coupler_protocol.wire.attendant import REST, TIDY, Attendant
from coupler_protocol.wire.byte_line import Line
from coupler_protocol.wire.sparse_log import SparseLog
from coupler_protocol.wire.stranger_line import Allowance, StrangerLine

log = logging.getLogger(__name__)
Connection = TypeVar("Connection", socket.socket, Line)
BACKLOG = 16  # connections that wait in the kernel
WAITING = 16  # connections that have not proved themselves
PATIENCE = 2.0  # [s] for them to do so
LINES = 24  # connections that have
STRANGERS = 6  # of these, on a gate for everybody, those that have not joined the run
ACCEPTS = 500.0  # connections a second
FRAMES = 20.0  # frames and connections a second of all strangers of one machine together, on a gate for everybody
SESSIONS = 4  # that are kept; a run has one
MACHINES = 16  # machines whose strangers have an allowance of frames

REFUSED = {
    words.UNKNOWN: "its key is not on the list",
    words.REVOKED: "its key was revoked",
    words.UNPROVED: "it does not know the secret of its key",
    words.OTHER_SERVER: "its key file is of another continuum",
    words.FULL: "there are too many connections",
}


class _Visitor(NamedTuple):
    """A connection that has not proved itself: where from, since when [s], the greeting it got, what it said."""

    address: str
    since: float
    greeting: bytes
    heard: bytearray


class _Guest(NamedTuple):
    """A connection that has proved itself: where from, public key and name of the client."""

    address: str
    public: bytes
    name: str


class Gate(Attendant):
    """Listens on a socket and passes connections that prove themselves on to the Unix socket `inside`.

    on_revoked(public): called in the gate's thread when the connection of a client whose key was revoked is closed.
    """

    def __init__(self, listener: socket.socket, inside: str, rule: Rule, on_revoked: Callable[[bytes], object]) -> None:
        super().__init__("gate")
        self.listener, self.inside, self.rule, self.on_revoked = listener, inside, rule, on_revoked
        self.turned_away: Counter[str] = Counter()  # connections by reason
        self._sparse = SparseLog(log)
        self._visitors: dict[socket.socket, _Visitor] = {}
        self._guests: dict[Line, _Guest] = {}
        self._accepts = Allowance(ACCEPTS, 0.1 * ACCEPTS)
        self._frames: dict[str, Allowance] = {}  # of strangers by machine
        self._listening, self._next_tidy = False, 0.0
        listener.setblocking(False)
        self.thread.start()

    # -- the loop ----------------------------------------------------------------------------------------------------

    def _refuse_more(self) -> None:
        self._listen(False)

    def _busy(self) -> bool:
        return any(line.open for line in self._guests)

    def _connections(self) -> Iterable[Any]:
        return (*self._guests, *self._visitors, self.listener)

    def _serve(self, seconds: float) -> None:
        """Handles what happens within a time [s]."""
        for key, events in self._selector.select(seconds):
            if key.fileobj is self.listener:
                self._accept()
            elif isinstance(key.data, tuple):
                line, end = key.data
                line.serve(end, events)
                if isinstance(line, StrangerLine) and line.session:
                    self._note_session(line)
                self._note_end(line)
            elif key.fileobj in self._visitors:
                self._hear(key.fileobj)

    def _rest(self) -> float:
        """Looks at the clocks; returns for how long [s] nothing has to be looked at."""
        now = time.monotonic()
        for connection, visitor in list(self._visitors.items()):
            if now - visitor.since > PATIENCE:
                self._turn_away(connection, "too slow", f"it said too little in {PATIENCE:g} s")
        paused = False
        for line in list(self._guests):
            if line.deadline is not None and now > line.deadline:
                line.close()
            elif isinstance(line, StrangerLine):
                paused |= line.go_on(now)
            self._note_end(line)
        self._listen(self._accepts.left(now) >= 1.0)
        if now >= self._next_tidy:
            self._next_tidy = now + TIDY
            self._close_revoked()
        return REST if paused or not self._listening or self._lingers() else TIDY

    def _note_session(self, line: StrangerLine) -> None:
        """Stores the session that the continuum has told a connection: who knows it can come back."""
        if isinstance(self.rule, SecretRule) and line.session not in self.rule.sessions:
            self.rule.sessions = [*self.rule.sessions, line.session][-SESSIONS:]
        line.session = b""

    def _lingers(self) -> bool:
        return bool(self._visitors) or any(line.deadline is not None for line in self._guests)

    def _note_end(self, line: Line) -> None:
        """Forgets a line that is closed."""
        if not line.open and (guest := self._guests.pop(line, None)) and isinstance(line, StrangerLine) and line.fault:
            self._count("frames", f"the connection from {guest.address} is closed: {line.fault}")

    def _close_revoked(self) -> None:
        """Closes the connections of clients whose keys were revoked."""
        gone: dict[bytes, bool] = {}
        for line, guest in list(self._guests.items()):
            with contextlib.suppress(EnvironmentFailed, OSError):  # said where the key folder is read for a claim
                if guest.public not in gone:
                    gone[guest.public] = self.rule.revoked(guest.public)
                if gone[guest.public]:
                    log.warning("the key %r was revoked: its connection from %s is closed", guest.name, guest.address)
                    line.close()
                    self._note_end(line)
                    self.on_revoked(guest.public)

    # -- who comes ---------------------------------------------------------------------------------------------------

    def _listen(self, wanted: bool) -> None:
        if wanted != self._listening:
            if wanted:
                self._selector.register(self.listener, selectors.EVENT_READ, None)
            else:
                self._selector.unregister(self.listener)
            self._listening = wanted

    def _accept(self) -> None:
        """Greets a connection."""
        try:
            connection, address = self.listener.accept()
        except OSError as error:
            if not isinstance(error, BlockingIOError | ConnectionError):
                self._count("accept", f"no connection can be accepted: {error.strerror}")
                self._accepts.use(self._accepts.most)  # the listener would report it without a pause
            return
        self._accepts.use(1.0)
        if len(self._visitors) >= WAITING:
            self._turn_away(self._oldest_of_busiest(self._visitors), "crowded out", "too many wait")
        connection.setblocking(False)
        said = words.greeting(self.rule.kind, self.rule.number, secrets.token_bytes(words.NONCE))
        with contextlib.suppress(OSError):  # it has gone, which shows at its first read
            connection.send(said)
        self._visitors[connection] = _Visitor(_text_of(address), time.monotonic(), said, bytearray())
        self._selector.register(connection, selectors.EVENT_READ, connection)

    def _oldest_of_busiest(self, where: Mapping[Connection, _Visitor | _Guest]) -> Connection:
        """The first connection of the machine that has most of them."""
        busiest = Counter(_host_of(who.address) for who in where.values()).most_common(1)[0][0]
        return next(what for what, who in where.items() if _host_of(who.address) == busiest)

    def _hear(self, connection: socket.socket) -> None:
        """Reads what there is of a claim, and judges it once it is whole."""
        visitor = self._visitors[connection]
        try:
            data = connection.recv(words.CLAIM.size - len(visitor.heard))
        except BlockingIOError:
            return
        except OSError:
            data = b""
        visitor.heard.extend(data)
        if not data:
            self._turn_away(connection, "left", "it went away")
        elif visitor.heard[: len(words.MAGIC)] != words.MAGIC[: len(visitor.heard)]:
            self._turn_away(connection, "foreign", words.FOREIGN)
        elif len(visitor.heard) == words.CLAIM.size:
            self._judge(connection, visitor)

    def _judge(self, connection: socket.socket, visitor: _Visitor) -> None:
        try:
            claim = words.read_claim(bytes(visitor.heard))
            found = self.rule.judge(claim, visitor.greeting)
        except words.ForeignError as error:
            return self._turn_away(connection, "foreign", str(error))
        except (EnvironmentFailed, OSError) as error:
            return self._turn_away(connection, "keys", f"its key cannot be checked: {error}")
        if found.verdict == words.WELCOME and not self._has_room(visitor.address, found):
            found = found._replace(verdict=words.FULL)
        answer = words.verdict(found.verdict, visitor.greeting, claim, found.secret)
        if found.verdict == words.WELCOME:
            return self._admit(connection, visitor, claim, found, answer)
        with contextlib.suppress(OSError):
            connection.send(answer)
        key = f" (key {found.name!r})" if found.name else ""
        why = REFUSED.get(found.verdict) or _other_kind(claim.kind, self.rule.kind)
        return self._turn_away(connection, why, f"{why}{key}")

    def _has_room(self, address: str, found: Judged) -> bool:
        """Whether one more connection can be admitted; on a gate for everybody, a stranger counts as a frame of its machine."""
        if self._is_stranger(found):
            allowance = self._allowance(address)
            if allowance.left(time.monotonic()) < 1.0:
                return False
            allowance.use(1.0)
        return len(self._guests) < LINES

    def _is_stranger(self, found: Judged) -> bool:
        return self.rule.kind == words.OPEN and found.name != JOINED

    def _admit(self, connection: socket.socket, visitor: _Visitor, claim: words.Claim, found: Judged, answer: bytes) -> None:
        """Begins to pass the bytes of a connection on."""
        del self._visitors[connection]
        self._selector.unregister(connection)
        inside = socket.socket(socket.AF_UNIX)
        try:
            inside.connect(self.inside)
            connection.send(answer)
        except OSError as error:
            inside.close()
            connection.close()
            return self._count("lost", f"a connection from {visitor.address} was lost: {error.strerror}")
        guest = _Guest(visitor.address, claim.public, found.name)
        if self._is_stranger(found):
            self._make_room(line for line in self._guests if isinstance(line, StrangerLine) and not line.joined)
            self._guests[StrangerLine(self._selector, connection, inside, self._allowance(guest.address))] = guest
        else:
            self._guests[Line(self._selector, connection, inside)] = guest
            log.info("a connection from %s was admitted%s", guest.address, f" (key {guest.name!r})" if guest.name else "")
        return None

    def _allowance(self, address: str) -> Allowance:
        """The allowance of frames for strangers of a machine."""
        host = _host_of(address)
        if host not in self._frames:
            if len(self._frames) >= MACHINES:
                del self._frames[next(iter(self._frames))]
            self._frames[host] = Allowance(FRAMES, 2.0 * FRAMES)
        return self._frames[host]

    def _make_room(self, strangers: Iterable[Line]) -> None:
        """Closes a connection of those that have not joined the run, if there are too many."""
        found = {line: self._guests[line] for line in strangers}
        if len(found) >= STRANGERS:
            line = self._oldest_of_busiest(found)
            line.close()
            self._note_end(line)
            self._count("strangers", "too many connections that have not joined the run: the oldest is closed")

    def _turn_away(self, connection: socket.socket, kind: str, why: str) -> None:
        visitor = self._visitors.pop(connection)
        self._selector.unregister(connection)
        connection.close()
        self._count(kind, f"a connection from {visitor.address} was refused: {why}")

    def _count(self, kind: str, text: str) -> None:
        self.turned_away[kind] += 1
        self._sparse.warn(kind, text)


def _other_kind(theirs: int, ours: int) -> str:
    """Why a claim of another kind is refused."""
    if ours == words.KEYED:
        return "it has no key"
    if theirs == words.KEYED:
        return "it comes with a key, and this continuum was started without keys"
    return f"it is of another kind, and this continuum {words.KINDS[ours]}"


def _host_of(address: str) -> str:
    """HOST of HOST:PORT."""
    return address.rpartition(":")[0]


def _text_of(address: tuple) -> str:
    """HOST:PORT of a peer."""
    return f"{address[0]}:{address[1]}"
