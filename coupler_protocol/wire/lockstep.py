"""Turns of one conversation between the continuum and one discrete process, the same over every transport.

The discrete side sends a message, the continuum answers with the same sequence number, and the next turn has the next number.
After a time without a message a side sends its last message again with the flag AGAIN. A side that has already answered such a
message sends the same bytes again. So a lost or doubled message changes nothing, and during a long phase of one side the other
only waits.

Every wait is bounded (clocks.py). A side that computes for long between two messages, or waits for another peer, sends PROGRESS,
which has no turn. A peer with many invalid messages in a row is also given up.
"""

import logging
import time
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from typing import Any, Protocol

from coupler_protocol.exits import PeerLost
from coupler_protocol.wire import frames, messages
from coupler_protocol.wire.clocks import STEPS, Clocks, Wait, Waiting
from coupler_protocol.wire.frames import Buffer
from coupler_protocol.wire.lanes import Lanes
from coupler_protocol.wire.sparse_log import SparseLog

log = logging.getLogger(__name__)
REASON = 2000  # characters of a peer's reason that are shown
PATIENCE = 10.0  # seconds that a coupled step may take after a request to stop: both sides then save the same moment
REFUSALS = 50  # messages of one turn that may be refused
PROBE = 1.0  # [s] between two questions of others whether the holder of a rank is there
MAX_HELLO = 4 << 20  # largest message of an unknown sender in bytes
DONE = object()  # no work is left


class Transport(Protocol):
    """One end of a link, as in link_tcp.py and link_inproc.py. lanes: of its step messages, or None; endpoint: its address."""

    lanes: Lanes | None
    proves: bool  # whether only those speak who have proved that they may
    trouble: str  # why there is no connection, if this end knows
    endpoint: str

    @property
    def port(self) -> int:
        """Port of the link on the side of this end."""
        ...

    def door(self) -> Any:
        """A Door for the lane of a peer (lane_door.py); of the continuum."""
        ...

    def enter(self, offer: dict[str, Any]) -> Any:
        """Connection through the Door of an offer, or None; of a discrete process."""
        ...

    def send(self, frame: Buffer, rank: Any) -> None:
        """Sends a frame to the peer."""
        ...

    def receive(self, seconds: float) -> tuple[Any, Buffer] | None:
        """Waits for a frame; returns (sender, frame) or None."""
        ...

    def admit(self, sender: Any, rank: int) -> None:
        """Assigns later frames of this sender to `rank`."""
        ...

    def connected(self, rank: int) -> bool:
        """Whether a peer is connected."""
        ...

    def departed(self, rank: int) -> bool:
        """Whether nothing can arrive from the peer any more, apart from what has arrived: its end was in this process."""
        ...


class Conversation:
    """One side of the exchange with one peer. `rank` is that of the discrete process on both sides."""

    def __init__(self, transport: Transport, rank: int, peer: int, clocks: Clocks, stop: Any) -> None:
        self.transport, self.rank, self.peer = transport, rank, peer
        self.clocks, self.stop = clocks, stop
        self.answers = peer != 0  # the continuum answers: its message ends a turn
        self.session = 0
        self.sequence = 0  # number of the turn
        self.waited = 0.0  # seconds spent waiting since this was last set to zero
        self.repeated = 0  # messages sent again
        self.refused = 0  # frames refused
        self._last: Buffer = b""
        self._inbox: list[tuple[Any, Buffer]] = []
        self._quiet_until = 0.0  # time before which no message is sent again
        self._refused_now = 0
        self._next_probe = 0.0  # time before which `lives` sends nothing
        self._next_report = 0.0  # time before which no PROGRESS is sent
        self._wait: Wait | None = None
        self._name, self._log = ("the continuum", "fdm.rank0.log") if peer == 0 else (
            f"the discrete process of rank {rank}", f"dem.rank{rank}.log"
        )  # fmt: skip

    def waiting(self) -> Waiting | None:
        """The present wait for the peer, asked from another thread."""
        wait = self._wait
        return None if wait is None else wait.told

    def begin(self, session: int) -> None:
        """Starts with the first turn, and with the session of all later frames."""
        self.session, self.sequence = session, 0
        self._inbox.clear()

    # -- sending -----------------------------------------------------------------------------------------------------

    def send(self, frame: Buffer) -> None:
        """Sends the sealed frame of this turn, and keeps it until the next one to send it again. An answer ends the turn."""
        self._last = frame
        self.transport.send(frame, self.peer)
        self.sequence += self.answers

    def send_step(self, frame: frames.StepFrame) -> None:
        """Sends a coupler_protocol.wire.frames.StepFrame as `send` does, over the lane if there is one."""
        self._last, lanes = frame.seal(self.sequence), self.transport.lanes
        if lanes is None or not lanes.send(self._last, self.peer):
            self.transport.send(self._last, self.peer)
        self.sequence += self.answers

    def continue_from(self, sequence: int, said: frames.Buffer | None) -> None:
        """Goes on after turns over a lane: number of the present turn, and the last frame of this side if it is a new one."""
        self._last = self._last if said is None else said
        self.sequence = sequence

    def send_by_link(self) -> None:
        """Sends the last frame, which a lane could not send, over the link."""
        self.transport.send(self._last, self.peer)

    def send_control(self, kind: int, content: Mapping[str, Any]) -> None:
        """Sends a control message with the number of the current turn."""
        self.send(frames.control_frame(kind, self.session, self.rank, self.sequence, content))

    def end_steps(self, reason: str) -> None:
        """Sends STOP; no more step messages follow on a lane."""
        if self.transport.lanes is not None:
            self.transport.lanes.end_steps(self.peer)
        self.send_control(messages.STOP, {"reason": reason})

    def notify(self, kind: int, content: Mapping[str, Any]) -> None:
        """Sends a message without answer and turn."""
        self.transport.send(frames.control_frame(kind, self.session, self.rank, self.sequence, content), self.peer)

    def report(self, doing: str) -> None:
        """Sends PROGRESS to a peer that waits for this side, if the last one was not sent just now."""
        now = time.monotonic()
        if self.session and now >= self._next_report:
            self._next_report = now + self.clocks.report
            self.notify(messages.PROGRESS, {"doing": doing})

    # -- receiving ---------------------------------------------------------------------------------------------------

    def receive(self, kinds: tuple[int, ...], meanwhile: Iterator[object] | None = None) -> tuple[int, Buffer]:
        """Waits for one of `kinds` with the number of the current turn; returns (kind, frame).

        meanwhile: work for the time without a message; a message that arrives waits for one piece of it at most.
        Raises PeerLost if the clock of its phase runs out, if the peer was not connected for too long, or after a FAILURE of the
        peer; Interrupted if a stop was requested.
        """
        wait = Wait(self.clocks, kinds, self._name, self._log)
        patience = PATIENCE if wait.phase is STEPS else 0.0
        self.stop.check(patience)
        self._wait = wait
        looked = said = wait.begin
        self._quiet_until = wait.begin + 0.5 * self.clocks.timeout
        self._refused_now = 0
        try:
            while True:
                departed = self.transport.departed(self.peer)
                received = self._inbox.pop(0) if self._inbox else self._next(meanwhile)
                if received is not None:
                    sender, frame = received
                    if sender == self.peer:
                        kind = self._accepted_kind(frame, kinds)
                        if kind is not None:
                            self.sequence += not self.answers
                            if wait.phase is STEPS and self.transport.lanes is not None:
                                self.transport.lanes.note_way(frame, self.peer)
                            return kind, frame
                    else:
                        self._other_sender(sender, frame)
                elif departed:
                    self.stop.check()
                    raise PeerLost(f"{self._name} ended without a word; read its {self._log}")
                now = time.monotonic()
                if received is not None and now - looked < self.clocks.slice:
                    continue
                looked = now
                self.stop.check(patience)
                if now - said > self.clocks.timeout:
                    said = now
                    self.send_again()
                self._look_after_others(wait)
                if self.transport.connected(self.peer):
                    wait.connected = now
                if why := wait.over(now):
                    raise PeerLost("; ".join(filter(None, (why, self.transport.trouble))))
        finally:
            self._wait = None
            self.waited += time.monotonic() - wait.begin

    def _look_after_others(self, wait: Wait) -> None:
        """Called now and then during a wait: tells other peers of a shared transport, which wait for this side, about it."""

    def _next(self, meanwhile: Iterator[object] | None) -> tuple[Any, Buffer] | None:
        """The next frame with its sender; None after a slice of time, or a piece of work, without one."""
        if meanwhile is not None:
            received = self.transport.receive(0.0)
            if received is not None or next(meanwhile, DONE) is not DONE:
                return received
        return self.transport.receive(self.clocks.slice)

    def send_again(self) -> bool:
        """Sends the last message again, with the flag AGAIN; returns whether the peer is connected."""
        self._repeat(frames.AGAIN)
        return self.transport.connected(self.peer)

    def lives(self) -> bool:
        """Whether the peer is connected; asked by others as often as they like, it sends something once in PROBE seconds."""
        now = time.monotonic()
        if now < self._next_probe:
            return self.transport.connected(self.peer)
        self._next_probe = now + PROBE
        return self.send_again()

    def _repeat(self, flags: int = 0) -> None:
        if self._last:
            self.repeated += 1
            self._quiet_until = time.monotonic() + 0.5 * self.clocks.timeout
            self.transport.send(frames.sent_again(self._last) if flags else self._last, self.peer)

    def _accepted_kind(self, frame: Buffer, kinds: Sequence[int]) -> int | None:
        """Kind of a frame for which this turn waits; None for other frames, which are handled here. Raises PeerLost."""
        try:
            kind, session, rank, flags, sequence = frames.open_header(frame)
            if rank != self.rank:
                raise frames.WireError(f"it is of rank {rank}, not {self.rank}")
            if self.session and session != self.session and (session or kind not in messages.SESSIONLESS):
                raise frames.WireError("it belongs to another session")
        except frames.VersionError as error:
            raise PeerLost(f"{self._name} speaks another language: {error}") from None
        except frames.WireError as error:
            self._refuse(error)
            return None
        if kind == messages.PROGRESS:
            self._note_progress(frame)
            return None
        if kind in messages.ONE_WAY and kind not in kinds:
            self.stop.check()  # both sides were requested to stop, and the other ended first
            raise PeerLost(f"{self._name} ended: {_reason(frame)}")
        if sequence == self.sequence and kind in kinds:
            return kind
        if sequence >= self.sequence:
            self._refuse(f"{messages.NAMES[kind]} {sequence} while turn {self.sequence} waits for "
                         + " or ".join(messages.NAMES[k] for k in kinds))  # fmt: skip
        elif flags & frames.AGAIN and sequence == self.sequence - 1 and time.monotonic() > self._quiet_until:
            self._repeat()
        return None

    def _note_progress(self, frame: Buffer) -> None:
        try:
            doing = frames.one_line(frames.content_of(frame)["doing"])
        except frames.WireError as error:
            self._refuse(error)
            return
        if self._wait is not None:
            self._wait.note_word(doing)

    def _refuse(self, why: Any) -> None:
        self.refused += 1
        self._refused_now += 1
        log.warning("a message from %s was refused: %s", self._name, why)
        if self._refused_now >= REFUSALS:
            raise PeerLost(f"{self._name} cannot be understood: {self._refused_now} messages refused, the last because {why}")

    def _other_sender(self, sender: Any, frame: Buffer) -> None:
        """Handles a frame of another sender on a shared transport."""
        log.warning("a message from %r was refused: no other process is expected here", sender)


def _reason(frame: Buffer) -> str:
    try:
        return frames.one_line(frames.content_of(frame)["reason"], REASON)
    except frames.WireError as error:
        return f"its reason cannot be read ({error})"


class Hub:
    """Conversations of the continuum: one for each rank over one transport.

    last_words: {rank: reason in FAILURE of a process that did not have the rank}.
    """

    def __init__(self, transport: Transport, ranks: Iterable[int], clocks: Clocks, stop: Any) -> None:
        self.transport, self.clocks, self.stop = transport, clocks, stop
        self.conversations = {r: _HubConversation(self, r) for r in ranks}
        self.last_words: dict[int, str] = {}
        self._strangers = SparseLog(log)
        self._next_report = 0.0
        self.arrival: Waiting | None = None  # while ranks are missing

    def waiting(self) -> Waiting | None:
        """The present wait for a rank, asked from another thread."""
        found = (conversation.waiting() for conversation in self.conversations.values())
        return self.arrival or next(filter(None, found), None)

    def report(self, doing: str, step: int | None = None, but: int = 0) -> None:
        """Sends PROGRESS to every rank that waits for this side, now and then. step: of a stage; but: rank that gets none.

        Raises PeerLost if one of them is not connected for too long.
        """
        if not self.conversations or (now := time.monotonic()) < self._next_report:
            return
        self._next_report = now + self.clocks.report
        text = doing if step is None else f"{doing}: step {step}"
        for rank, conversation in self.conversations.items():
            if rank != but and conversation.session:
                conversation.notify(messages.PROGRESS, {"doing": text})
                conversation.note_connection(now, doing)

    def notify_all(self, kind: int, content: Mapping[str, Any]) -> None:
        """Sends a message without answer to every rank."""
        for conversation in self.conversations.values():
            conversation.notify(kind, content)

    def receive_hello(self) -> tuple[Any, int, bytes] | None:
        """Waits for HELLO of an unknown sender: returns (sender, rank, frame), or None after a slice of time without one."""
        self.stop.check()
        received = self.transport.receive(self.clocks.slice)
        if received is None:
            return None
        sender, frame = received
        if sender in self.conversations:
            self.conversations[sender].store(frame)
            return None
        rank = self.claimed_rank(sender, frame)
        return None if rank is None else (sender, rank, bytes(frame))

    def claimed_rank(self, sender: Any, frame: Buffer) -> int | None:
        """Rank that an unknown sender claims with HELLO; None for all other frames, which are refused here."""
        try:
            if len(frame) > MAX_HELLO:
                self._refuse_large(sender, frame)
            kind, _, rank, _, _ = frames.open_header(frame)
        except frames.VersionError as error:
            self.reject(sender, 0, str(error))
            return None
        except frames.WireError as error:
            self._strangers.warn("message", f"a message of a stranger was refused: {error}")
            return None
        if kind == messages.HELLO:
            return rank
        if kind == messages.FAILURE and rank in self.conversations:
            self.last_words[rank] = frames.one_line(_reason(frame))
        elif kind not in (*messages.ONE_WAY, messages.PROGRESS):
            self.reject(sender, rank, "this continuum does not know this process: it belongs to another run")
        return None

    def _refuse_large(self, sender: Any, frame: Buffer) -> None:
        """Answers a HELLO that is larger than any can be, unread but for its header; raises WireError."""
        if frames.kind_of(frame) == messages.HELLO and bytes(frame[: len(frames.MAGIC)]) == frames.MAGIC:
            self.reject(sender, frames.rank_of(frame), f"HELLO has {len(frame)} bytes, {MAX_HELLO} are allowed")
        raise frames.WireError(f"{len(frame)} bytes are too many")

    def reject(self, sender: Any, rank: int, reason: str) -> None:
        """Sends REJECT to a sender that claims `rank`."""
        reason = frames.one_line(reason)
        self._strangers.warn(f"rank {rank in self.conversations}", f"a process that claims rank {rank} was rejected: {reason}")
        self.transport.send(frames.control_frame(messages.REJECT, 0, rank, 0, {"reason": reason}), sender)

    def objection(self, rank: int, taken: Container[int]) -> str | None:
        """Reason why an unknown sender cannot have `rank`, or None. taken: ranks with a process."""
        if rank not in self.conversations:
            return f"the scene has ranks {sorted(self.conversations)}, not {rank}"
        if rank in taken and self.conversations[rank].lives():
            return f"rank {rank} is taken and its holder lives"
        return None


class _HubConversation(Conversation):
    """A conversation that shares its transport with others: it puts their frames into their inboxes."""

    def __init__(self, hub: Hub, rank: int) -> None:
        super().__init__(hub.transport, rank, rank, hub.clocks, hub.stop)
        self.hub = hub
        self._gone_since: float | None = None

    def store(self, frame: Buffer) -> None:
        """Stores a frame that was received during the wait for another rank; what has no turn is handled immediately."""
        if frames.kind_of(frame) in (*messages.ONE_WAY, messages.PROGRESS):
            self._accepted_kind(frame, ())
        else:
            self._inbox.append((self.peer, bytes(frame)))

    def note_connection(self, now: float, doing: str) -> None:
        """Looks at the connection of a peer for which nobody waits now; raises PeerLost if it is gone for too long."""
        if self.transport.connected(self.rank):
            self._gone_since = None
        elif self._gone_since is None:
            self._gone_since = now
        elif now - self._gone_since > self.clocks.give_up:
            raise PeerLost(
                f"{self._name} was lost: not connected for {now - self._gone_since:.1f} s (link.give_up = "
                f"{self.clocks.give_up:g} s) during: {doing}; check that the process runs, its {self._log}, and the network"
            )

    def _look_after_others(self, wait: Wait) -> None:
        self.hub.report(f"{wait.phase.name}: waits for rank {self.rank}", but=self.rank)

    def _other_sender(self, sender: Any, frame: Buffer) -> None:
        if sender in self.hub.conversations:
            self.hub.conversations[sender].store(frame)
            return
        rank = self.hub.claimed_rank(sender, frame)
        if rank is not None:
            gone = f"rank {rank} lost its process, which cannot be replaced while the run goes on"
            self.hub.reject(sender, rank, self.hub.objection(rank, self.hub.conversations) or gone)
