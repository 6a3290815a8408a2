"""Whose turn it is: one conversation between the continuum and one discrete process, the same over every transport.

The discrete side speaks, the continuum answers with the same sequence number, the next turn has the next number. Silence makes
a side send its last words again, marked as such; whoever gets words marked so that it has answered already, answers again with
the same bytes. So a lost or doubled message changes nothing, and a long phase of one side costs the other only patience.

A peer counts as lost when it was not connected for `give_up` seconds, or, connected, owed a step for ten times as long.
"""

import logging
import time

from coupler_protocol import messages, wire
from coupler_protocol.exits import PeerLost

log = logging.getLogger(__name__)
SLICE = 0.2  # seconds between looks at the stop request while waiting


class Clocks:
    """How long silence is borne: `timeout` before words are said again, `give_up` before the peer counts as lost [s]."""

    def __init__(self, link):
        self.timeout, self.give_up = link.timeout, link.give_up
        self.slice = min(SLICE, link.timeout)


class Conversation:
    """One side of the exchange with one peer. `rank` is the discrete process's rank on both sides."""

    def __init__(self, transport, rank, peer, clocks, stop):
        self.transport, self.rank, self.peer = transport, rank, peer
        self.clocks, self.stop = clocks, stop
        self.session = 0
        self.sequence = 0
        self.waited = 0.0  # seconds spent waiting since somebody last set this to zero
        self.repeated = 0  # messages sent again
        self.refused = 0  # frames not believed
        self._last = b""
        self._inbox = []
        self._name = "the continuum" if peer == 0 else f"the discrete process of rank {rank}"

    # -- saying ------------------------------------------------------------------------------------------------------

    def say(self, frame):
        """Send the sealed frame of this turn; it is kept until the next one for saying it again."""
        self._last = frame
        self.transport.send(frame, self.peer)

    def say_control(self, kind, content):
        """Say a message other than a step with the current turn's number."""
        self.say(wire.control_frame(kind, self.session, self.rank, self.sequence, content))

    def tell(self, kind, content):
        """Say something that asks for no answer and takes no turn (a failure)."""
        self.transport.send(wire.control_frame(kind, self.session, self.rank, self.sequence, content), self.peer)

    # -- hearing -----------------------------------------------------------------------------------------------------

    def hear(self, kinds, in_step=False):
        """Wait for one of `kinds` with the current turn's number; returns (kind, frame).

        Raises PeerLost after too long a silence or when the peer says that it failed, Interrupted when a stop was asked for.
        """
        begin = said = heard = time.monotonic()
        try:
            while True:
                received = self._inbox.pop(0) if self._inbox else self.transport.receive(self.clocks.slice)
                if received is None:
                    self.stop.check()
                    now = time.monotonic()
                    if now - said > self.clocks.timeout:
                        said = now
                        self._say_again()
                    heard = self._patience(now, heard, in_step)
                    continue
                sender, frame = received
                if sender != self.peer:
                    self._elsewhere(sender, frame)
                    continue
                kind = self._believe(frame, kinds)
                heard = time.monotonic()
                if kind is not None:
                    return kind, frame
        finally:
            self.waited += time.monotonic() - begin

    def _patience(self, now, heard, in_step):
        """Time the peer was last known to be alive; raises PeerLost when that was too long ago."""
        silent = now - heard
        if self.transport.connected(self.peer):
            if in_step and silent > 10 * self.clocks.give_up:
                raise PeerLost(f"{self._name} is connected but has not answered for {silent:.0f} s")
            return heard if in_step else now
        if silent > self.clocks.give_up:
            raise PeerLost(f"{self._name} was lost: not connected and silent for {silent:.1f} s (give_up)")
        return heard

    def _say_again(self):
        if self._last:
            self.repeated += 1
            self.transport.send(wire.sent_again(self._last), self.peer)

    def _believe(self, frame, kinds):
        """The kind of a frame that is what this turn waits for; None for one that is dealt with here."""
        try:
            kind, session, rank, flags, sequence = wire.open_header(frame)
            if rank != self.rank or (session != self.session and self.session and session):
                raise wire.WireError(f"session or rank {rank} is not the one agreed")
        except wire.WireError as error:
            self._refuse(error)
            return None
        if kind in messages.ONE_WAY and kind not in kinds:
            reason = wire.content_of(frame).get("reason", "no reason given")
            raise PeerLost(f"{self._name} ended: {reason}")
        if sequence == self.sequence and kind in kinds:
            return kind
        if flags & wire.AGAIN and sequence == self.sequence - 1:
            self._say_again_plainly()
        elif not flags & wire.AGAIN and sequence >= self.sequence:
            self._refuse(f"{messages.NAMES[kind]} {sequence} while turn {self.sequence} waits for "
                         + " or ".join(messages.NAMES[k] for k in kinds))  # fmt: skip
        return None

    def _say_again_plainly(self):
        if self._last:
            self.repeated += 1
            self.transport.send(self._last, self.peer)

    def _refuse(self, why):
        self.refused += 1
        log.warning("a message from %s was refused: %s", self._name, why)

    def _elsewhere(self, sender, frame):
        """A frame of somebody else on a shared transport."""
        self._refuse(f"unexpected sender {sender!r}")


class Hub:
    """The continuum's side: one conversation for each rank over one transport."""

    def __init__(self, transport, ranks, clocks, stop):
        self.transport, self.clocks, self.stop = transport, clocks, stop
        self.conversations = {r: _HubConversation(self, r) for r in ranks}

    def tell_all(self, kind, content):
        """Say something one-way to every rank."""
        for conversation in self.conversations.values():
            conversation.tell(kind, content)

    def hear_next(self, kinds):
        """The first of `kinds` from a sender not admitted yet: (sender, rank, frame), or None after a slice of silence."""
        received = self.transport.receive(self.clocks.slice)
        self.stop.check()
        if received is None:
            return None
        sender, frame = received
        try:
            kind, _, rank, _, _ = wire.open_header(frame)
        except wire.WireError as error:
            log.warning("a message was refused: %s", error)
            return None
        if sender in self.conversations:
            self.conversations[sender]._inbox.append((sender, bytes(frame)))
        elif kind in kinds:
            return sender, rank, bytes(frame)
        return None


class _HubConversation(Conversation):
    """A conversation that shares its transport with its sisters: what is for them goes into their inboxes."""

    def __init__(self, hub, rank):
        super().__init__(hub.transport, rank, rank, hub.clocks, hub.stop)
        self.hub = hub

    def _elsewhere(self, sender, frame):
        if sender in self.hub.conversations:
            self.hub.conversations[sender]._inbox.append((sender, bytes(frame)))
            return
        try:
            _, _, rank, _, sequence = wire.open_header(frame)
        except wire.WireError as error:
            self._refuse(error)
            return
        refusal = {"reason": f"rank {rank} is taken and its holder lives"}
        self.transport.send(wire.control_frame(messages.REJECT, 0, rank, sequence, refusal), sender)
