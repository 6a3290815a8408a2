"""The in-process twin of the link: the same frames through queues between threads of one process."""

import os
import queue
import secrets
import select
import socket
import threading
import time
from collections.abc import Callable
from typing import Any

from coupler_protocol.wire.frames import Buffer
from coupler_protocol.wire.lanes import Lanes

AWAKE = 5e-4  # [s] before this side sleeps
NAP = 1e-3  # [s] of sleep on the lanes before the queue is looked at


class InprocTransport:
    """One end of a set of queues; the methods are those of `coupler_protocol.wire.link_tcp`.

    users: {name of an end: the thread that uses it}, shared by all ends; an end without a live thread is not connected.
    """

    endpoint = "inproc"
    local, port = True, 0  # both ends are on one machine

    def __init__(
        self, inbox: queue.Queue, outboxes: dict[Any, queue.Queue], me: Any, users: dict[Any, threading.Thread | None],
        ways: dict[bytes, socket.socket] | None = None,
    ) -> None:  # fmt: skip
        self.lanes: Lanes | None = None  # set by the handshake
        self.ways = {} if ways is None else ways  # other ends of lanes by their tokens, shared by all ends
        self.inbox, self.outboxes, self.me, self.users = inbox, outboxes, me, users
        self._rank: dict[Any, int] = {}
        self._name: dict[int, Any] = {0: 0}

    def send(self, frame: Buffer, rank: Any = 0) -> None:
        """Puts a copy of the frame into the peer's queue."""
        self._here()
        outbox = self.outboxes.get(self._name.get(rank, rank))
        if outbox is not None:
            outbox.put((self.me, bytes(frame)))

    def receive(self, seconds: float) -> tuple[Any, Buffer] | None:
        """Waits for a frame; returns (sender, frame), or None after `seconds` without one."""
        self._here()
        try:
            if self.lanes is None:
                sender, frame = self.inbox.get(timeout=seconds)
            elif (found := self._await(seconds)) is not None:
                return found
            else:
                sender, frame = self.inbox.get_nowait()
        except queue.Empty:
            return None
        return self._rank.get(sender, sender), memoryview(frame)

    def _await(self, seconds: float) -> tuple[int, memoryview] | None:
        """Waits for a frame on either way; returns (rank, frame) of a lane, None if the queue has one or none came."""
        assert self.lanes is not None
        begin = time.monotonic()
        while True:
            found = self.lanes.look()
            waited = time.monotonic() - begin
            if found is not None or not self.inbox.empty() or waited > seconds:
                return found
            if waited < AWAKE:
                os.sched_yield()
            else:
                select.select(list(filter(None, self.lanes.sockets)), [], [], NAP)

    def door(self) -> "Hatch":
        """A Hatch for the lane of a discrete thread."""
        return Hatch(self.ways)

    def enter(self, offer: dict[str, Any]) -> socket.socket | None:
        """Connection through a Hatch of the continuum."""
        return self.ways.pop(offer["token"], None)

    def admit(self, sender: Any, rank: int) -> None:
        """Assigns later frames of this sender to `rank`."""
        self._rank = {s: r for s, r in self._rank.items() if r != rank}
        self._rank[sender], self._name[rank] = rank, sender

    def connected(self, rank: int = 0) -> bool:
        """Whether the thread of the other end is alive and has not closed it."""
        user: Any = self.users.get(self._name.get(rank, rank), self)
        return user is self or (user is not None and user.is_alive())

    def departed(self, rank: int = 0) -> bool:
        """Whether the other end is closed or its thread has ended."""
        name = self._name.get(rank, thread_name(rank))
        if name not in self.users:  # not begun
            return False
        user = self.users[name]
        return user is None or not user.is_alive()

    def close(self) -> None:
        """Closes this end and its lanes."""
        self.users[self.me] = None
        if self.lanes is not None:
            self.lanes.close_all()

    def _here(self) -> None:
        if self.me not in self.users:
            self.users[self.me] = threading.current_thread()


class Hatch:
    """The in-process twin of coupler_protocol.wire.lane_door.Door: a pair of connected sockets. ways: token to the other end."""

    def __init__(self, ways: dict[bytes, socket.socket]) -> None:
        token = secrets.token_bytes(8)
        self.offer: dict[str, Any] = {"port": 0, "token": token}
        self._own, ways[token] = socket.socketpair()

    def admit(self, check: Callable[[], object]) -> socket.socket:
        """The continuum's end."""
        return self._own


def thread_name(rank: int) -> str:
    """Name of the end of a discrete thread."""
    return f"thread {rank}"


def transports(n_ranks: int) -> tuple[InprocTransport, list[InprocTransport]]:
    """The continuum's end and a list of the discrete ends, rank 1 first."""
    names = [thread_name(rank) for rank in range(1, n_ranks + 1)]
    inbox: queue.Queue = queue.Queue()
    inboxes: dict[str, queue.Queue] = {name: queue.Queue() for name in names}
    users: dict[Any, threading.Thread | None] = {}
    ways: dict[bytes, socket.socket] = {}
    hub = InprocTransport(inbox, inboxes, 0, users, ways)
    return hub, [InprocTransport(inboxes[name], {0: inbox}, name, users, ways) for name in names]
