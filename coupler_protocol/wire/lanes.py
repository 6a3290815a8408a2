"""Lanes: plain connections that carry the step messages of a side beside its link.

A lane is opened after WELCOME (coupler_protocol/wire/lane_door.py), on one machine or where the scene says so. Its frames are
those of the link. Control messages, messages that are sent again, and a FORCE with strain use the link. A lane that breaks, or on
which something unexpected arrives, is closed, and the link carries all messages from then on.
"""

import logging
import os
import socket
from collections.abc import Iterable
from functools import cache
from typing import NamedTuple

import numpy as np

from coupler_protocol.compiled import lane
from coupler_protocol.wire import messages
from coupler_protocol.wire.frames import HEADER, MAGIC, Buffer

log = logging.getLogger(__name__)
EARLIEST = 5000  # steps of a stage before which compiling a loop of plain steps, if no cache has it, costs more than it saves
LONGEST = 200_000_000  # [ns] of a row of plain steps, after which stop requests are obeyed
checksum_table = cache(lane.checksum_table)
ROOM = 4  # frames that fit into the buffer of a socket: two can be under way


class Peer(NamedTuple):
    """Other end of a lane: its rank, rank of the discrete process that takes part, number of nodes of the rim."""

    peer: int
    rank: int
    nodes: int


def step_size(kind: int, nodes: int) -> int:
    """Bytes of FORCE without strain, or of VELOCITY, for a rim of that many nodes."""
    numbers = len(messages.Answer._fields) + 3 * nodes if kind == messages.FORCE else len(messages.Order._fields) + 2 * nodes
    return HEADER.size + 8 * numbers


class Lanes:
    """Lanes of one side, one for each of W peers; `hears` and `says` are the kinds of messages that it receives and sends."""

    def __init__(self, session: int, peers: Iterable[Peer], hears: int, says: int) -> None:
        self.peers = list(peers)
        self.row = {peer.peer: number for number, peer in enumerate(self.peers)}
        self.sockets: list[socket.socket | None] = [None] * len(self.peers)
        self._over = [False] * len(self.peers)  # no more steps follow
        count = len(self.peers)
        inbox, in_at = self._room(hears)
        outbox, out_at = self._room(says)
        self.wire = lane.Wire(
            np.full(count, -1),
            np.zeros(count, dtype=np.int64),
            inbox,
            inbox.view(np.float64),
            in_at,
            self._heads(session, hears),
            outbox,
            outbox.view(np.float64),
            out_at,
            self._heads(session, says),
            np.zeros(count, dtype=np.int64),
            np.zeros(1, dtype=np.int64),
            np.zeros(1, dtype=np.int64),
            checksum_table(),
            np.zeros(2, dtype=np.int64),
        )
        self._bytes = memoryview(inbox.data).cast("B")

    def _room(self, kind: int) -> tuple[np.ndarray, np.ndarray]:
        at = np.concatenate([[0], np.cumsum([step_size(kind, peer.nodes) for peer in self.peers])])
        return np.zeros(at[-1] // 8).view(np.uint32), at.astype(np.int64)

    def _heads(self, session: int, kind: int) -> np.ndarray:
        def head(peer: Peer) -> bytes:
            size = step_size(kind, peer.nodes) - HEADER.size
            return HEADER.pack(MAGIC, messages.PROTOCOL_VERSION, kind, session, peer.rank, 0, 0, size, 0)

        return np.frombuffer(b"".join(map(head, self.peers)), dtype="<u4").reshape(-1, lane.HEADER_WORDS).astype(np.uint32)

    @property
    def whole(self) -> bool:
        """Whether the lanes to all peers are open."""
        return bool((self.wire.fd >= 0).all())

    @property
    def any(self) -> bool:
        """Whether a lane is open."""
        return bool((self.wire.fd >= 0).any())

    def open(self, rank: int, connection: socket.socket) -> None:
        """Begins to use a connection to the peer of `rank`."""
        row = self.row[rank]
        if connection.family != socket.AF_UNIX:
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        size = int(max(self.wire.in_at[row + 1] - self.wire.in_at[row], self.wire.out_at[row + 1] - self.wire.out_at[row]))
        for option in (socket.SO_SNDBUF, socket.SO_RCVBUF):
            if connection.getsockopt(socket.SOL_SOCKET, option) < ROOM * size:
                connection.setsockopt(socket.SOL_SOCKET, option, ROOM * size)
        connection.setblocking(False)
        self.sockets[row] = connection
        self.wire.fd[row] = connection.fileno()

    def end_steps(self, rank: int) -> None:
        """Notes that no more steps follow, so that the peer may close its end."""
        self._over[self.row[rank]] = True

    def close(self, rank: int, why: str = "") -> None:
        """Closes a lane; the link carries its messages from now on."""
        row = self.row[rank]
        found, self.sockets[row] = self.sockets[row], None
        self.wire.fd[row], self.wire.got[row] = -1, 0
        if found is not None:
            found.close()
            if why and not self._over[row]:
                log.warning("the lane to rank %d is closed, steps go over the link: %s", rank, why)

    def close_all(self) -> None:
        """Closes all lanes."""
        for peer in self.peers:
            self.close(peer.peer)

    def send(self, frame: Buffer, rank: int) -> bool:
        """Sends a step message; False if it has to go over the link."""
        row = self.row[rank]
        if self.wire.fd[row] < 0 or len(frame) != self.wire.out_at[row + 1] - self.wire.out_at[row]:
            return False
        try:
            sent = os.write(self.wire.fd[row], frame)
        except OSError as error:
            self.close(rank, str(error))
            return False
        if sent != len(frame):
            self.close(rank, f"only {sent} of {len(frame)} bytes could be sent")
        return sent == len(frame)

    def note_way(self, frame: Buffer, rank: int) -> None:
        """Closes the lane to a peer whose step message came over the link although it fits the lane.

        A message that was sent again because this side was silent for long is on the lane as well: then the lane stays open.
        """
        row = self.row[rank]
        fits = len(frame) == self.wire.in_at[row + 1] - self.wire.in_at[row]
        if self.wire.fd[row] < 0 or not fits or not isinstance(frame, memoryview) or frame.obj is self.wire.inbox:
            return
        begin = int(self.wire.in_at[row])
        if self._whole(row, rank) and turn_of(self._bytes[begin:]) == turn_of(frame):
            self.wire.got[row] = 0
        else:
            self.close(rank, "a step message came over the link")

    def said(self, row: int) -> memoryview:
        """The frame in the outbox for a peer."""
        return memoryview(self.wire.outbox.data).cast("B")[self.wire.out_at[row] : self.wire.out_at[row + 1]]

    def look(self) -> tuple[int, memoryview] | None:
        """(rank, frame) of a whole frame that is there, valid until the next look, or None."""
        for row, peer in enumerate(self.peers):
            if self.wire.fd[row] >= 0 and self._whole(row, peer.peer):
                self.wire.got[row] = 0
                return peer.peer, self._bytes[self.wire.in_at[row] : self.wire.in_at[row + 1]]
        return None

    def _whole(self, row: int, rank: int) -> bool:
        """Reads what is there of a frame; returns whether it is whole."""
        begin, end = int(self.wire.in_at[row]), int(self.wire.in_at[row + 1])
        try:
            while begin + self.wire.got[row] < end:
                number = os.readv(self.wire.fd[row], [self._bytes[begin + int(self.wire.got[row]) : end]])
                if number == 0:
                    self.close(rank, "the other side closed it")
                    return False
                self.wire.got[row] += number
        except BlockingIOError:
            return False
        except OSError as error:
            self.close(rank, str(error))
            return False
        head = self._bytes[begin : begin + HEADER.size].cast("I")
        expected = self.wire.in_head[row]
        if any(head[i] != expected[i] for i in range(lane.HEADER_WORDS) if i not in FREE):
            self.close(rank, "what arrived is not a message of this run")  # a stream cannot be read on from an unknown place
            return False
        return True


def turn_of(frame: memoryview) -> int:
    """Number of the turn in the header of a frame."""
    words = frame[: HEADER.size].cast("I")
    return words[lane.SEQUENCE] | words[lane.SEQUENCE + 1] << 32


FREE = (lane.FLAGS, lane.SEQUENCE, lane.SEQUENCE + 1, lane.CHECKSUM)  # words of a header that the conversation judges
