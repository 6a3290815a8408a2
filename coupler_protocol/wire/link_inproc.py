"""The in-process twin of the link: the same frames through queues between threads of one process."""

import queue
import threading
from typing import Any

from coupler_protocol.wire.frames import Buffer


class InprocTransport:
    """One end of a set of queues; the methods are those of `coupler_protocol.wire.link_tcp`.

    users: {name of an end: the thread that uses it}, shared by all ends; an end without a live thread is not connected.
    """

    endpoint = "inproc"

    def __init__(
        self, inbox: queue.Queue, outboxes: dict[Any, queue.Queue], me: Any, users: dict[Any, threading.Thread | None]
    ) -> None:
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
            sender, frame = self.inbox.get(timeout=seconds)
        except queue.Empty:
            return None
        return self._rank.get(sender, sender), memoryview(frame)

    def admit(self, sender: Any, rank: int) -> None:
        """Assigns later frames of this sender to `rank`."""
        self._rank = {s: r for s, r in self._rank.items() if r != rank}
        self._rank[sender], self._name[rank] = rank, sender

    def connected(self, rank: int = 0) -> bool:
        """Whether the thread of the other end is alive and has not closed it."""
        user: Any = self.users.get(self._name.get(rank, rank), self)
        return user is self or (user is not None and user.is_alive())

    def close(self) -> None:
        """Closes this end."""
        self.users[self.me] = None

    def _here(self) -> None:
        if self.me not in self.users:
            self.users[self.me] = threading.current_thread()


def transports(n_ranks: int) -> tuple[InprocTransport, list[InprocTransport]]:
    """The continuum's end and a list of the discrete ends, rank 1 first."""
    names = [f"thread {rank}" for rank in range(1, n_ranks + 1)]
    inbox: queue.Queue = queue.Queue()
    inboxes: dict[str, queue.Queue] = {name: queue.Queue() for name in names}
    users: dict[Any, threading.Thread | None] = {}
    hub = InprocTransport(inbox, inboxes, 0, users)
    return hub, [InprocTransport(inboxes[name], {0: inbox}, name, users) for name in names]
