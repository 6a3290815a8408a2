"""The in-process twin of the link: the same frames through queues between threads of one process."""

import queue


class InprocTransport:
    """One end of a pair of queues; the methods are those of `coupler_protocol.link`."""

    endpoint = "inproc"

    def __init__(self, inbox, outboxes, me):
        self.inbox, self.outboxes, self.me = inbox, outboxes, me
        self._rank = {}

    def send(self, frame, rank=0):
        """Put a copy of the frame into the peer's queue."""
        self.outboxes[rank].put((self.me, bytes(frame)))

    def receive(self, seconds):
        """(sender, frame) or None after `seconds` of silence."""
        try:
            sender, frame = self.inbox.get(timeout=seconds)
        except queue.Empty:
            return None
        return self._rank.get(sender, sender), memoryview(frame)

    def admit(self, sender, rank):
        """Frames of this sender are from `rank` from now on."""
        self._rank[sender] = rank
        self.outboxes[rank] = self.outboxes[sender]

    def connected(self, rank=0):
        """Threads of one process are."""
        return True

    def close(self):
        """Nothing is held open."""


def transports(n_ranks):
    """The continuum's end and a list of the discrete ends, rank 1 first."""
    names = [f"thread {rank}" for rank in range(1, n_ranks + 1)]
    inbox, inboxes = queue.Queue(), {name: queue.Queue() for name in names}
    hub = InprocTransport(inbox, dict(inboxes), 0)
    return hub, [InprocTransport(inboxes[name], {0: inbox}, name) for name in names]
