"""Transport over TCP with ZeroMQ: the continuum binds a ROUTER, each discrete process connects a DEALER.

A transport carries frames and knows ranks and nothing of what the frames say:

    send(frame, rank)             give a frame to the peer (dropped while there is none: the conversation sends again)
    receive(seconds)              (sender, frame) or None; the frame is valid until the next call
    admit(sender, rank)           frames of this sender are from `rank` from now on
    connected(rank)               whether a peer hangs on the other end
    close()

`link_inproc` has the same for two threads of one process.
"""

import contextlib
import os
import time

import zmq
from zmq.utils.monitor import recv_monitor_message

from coupler_protocol.exits import EnvironmentFailed
from coupler_protocol.wire import MAX_FRAME

HEARTBEAT, HEARTBEAT_TIMEOUT, LINGER = 1000, 5000, 1000  # ms
# One message is under way at a time, but ZeroMQ hands the room of delivered ones back in batches and late: with room for 8, a
# send that must not block finds the queue full now and then, the message is dropped, and the step costs a time-out.
HIGH_WATER = 1000
_UP = {zmq.EVENT_HANDSHAKE_SUCCEEDED}
_DOWN = {zmq.EVENT_DISCONNECTED}


class _Socket:
    """What both ends have in common: options, the buffer frames arrive in, the count of connections."""

    def __init__(self, kind):
        self.context = zmq.Context()
        self.socket = self.context.socket(kind)
        s = self.socket
        s.sndhwm = s.rcvhwm = HIGH_WATER
        s.linger = LINGER
        s.maxmsgsize = MAX_FRAME
        if not os.environ.get("COLLUVIUM_NO_HEARTBEAT"):  # for breakpoints in a debugger
            s.heartbeat_ivl, s.heartbeat_timeout = HEARTBEAT, HEARTBEAT_TIMEOUT
        self.monitor = s.get_monitor_socket()
        self.connections = 0
        self._buffer = bytearray(1 << 20)
        self._timeout = None

    def _wait(self, seconds):
        if seconds != self._timeout:
            self.socket.rcvtimeo = max(1, int(seconds * 1000))
            self._timeout = seconds

    def _take(self):
        """The next frame, in a buffer that is used again."""
        size = self.socket.recv_into(self._buffer)
        if size > len(self._buffer):  # it came in cut off: refused by its checksum, and sent again into more room
            self._buffer = bytearray(min(2 * size, MAX_FRAME))
            size = 0
        return memoryview(self._buffer)[:size]

    def _count_connections(self):
        while self.monitor.poll(0):
            event = recv_monitor_message(self.monitor)["event"]
            self.connections += (event in _UP) - (event in _DOWN)

    def close(self):
        """Close the socket; frames still waiting get a second to leave."""
        self.socket.disable_monitor()
        self.monitor.close(0)
        self.socket.close()
        self.context.term()


class HubTransport(_Socket):
    """The continuum's end: listens, and knows each rank by the routing id of the process that claimed it."""

    def __init__(self, endpoint):
        super().__init__(zmq.ROUTER)
        self.socket.router_handover = True
        try:
            self.socket.bind(endpoint)
        except zmq.ZMQError as error:
            raise EnvironmentFailed(f"cannot listen on {endpoint}: {error}") from None
        self.endpoint = self.socket.last_endpoint.decode().rstrip("\0")
        self._route, self._rank = {}, {}

    def send(self, frame, rank):
        """Send to the process that holds `rank`, or to a sender not admitted yet."""
        with contextlib.suppress(zmq.Again):
            self.socket.send_multipart([self._route.get(rank, rank), frame], zmq.NOBLOCK)

    def receive(self, seconds):
        """(rank, or the sender's routing id while it has none; frame), or None after `seconds` of silence."""
        self._wait(seconds)
        try:
            sender = self.socket.recv()
        except zmq.Again:
            return None
        frame = self._take()
        while self.socket.getsockopt(zmq.RCVMORE):
            self.socket.recv()
        return self._rank.get(sender, sender), frame

    def admit(self, sender, rank):
        """Bind the sender's routing id to `rank`."""
        self._route[rank], self._rank[sender] = sender, rank

    def connected(self, rank):
        """Whether as many peers are connected as ranks were admitted (single ranks cannot be told apart here)."""
        self._count_connections()
        return self.connections >= len(self._route)


class RankTransport(_Socket):
    """A discrete process's end, with an unguessable routing id."""

    def __init__(self, endpoint):
        super().__init__(zmq.DEALER)
        self.socket.routing_id = b"\1" + os.urandom(15)
        self.socket.reconnect_ivl, self.socket.reconnect_ivl_max = 100, 1000
        try:
            self.socket.connect(endpoint)
        except zmq.ZMQError as error:
            raise EnvironmentFailed(f"cannot connect to {endpoint}: {error}") from None
        self.endpoint = endpoint

    def send(self, frame, rank=0):
        """Send to the continuum."""
        with contextlib.suppress(zmq.Again):
            self.socket.send(frame, zmq.NOBLOCK)

    def receive(self, seconds):
        """(0, frame), or None after `seconds` of silence."""
        self._wait(seconds)
        try:
            return 0, self._take()
        except zmq.Again:
            return None

    def admit(self, sender, rank):
        """There is only one peer."""

    def connected(self, rank=0):
        """Whether the continuum is connected."""
        self._count_connections()
        return self.connections > 0


def any_port(endpoint):
    """ZeroMQ's way of asking for any free port, for tcp://HOST:0."""
    return endpoint[:-1] + "*" if endpoint.endswith(":0") else endpoint


def is_loopback(endpoint):
    """Whether tcp://HOST:PORT names this machine only."""
    host = endpoint.removeprefix("tcp://").rpartition(":")[0].strip("[]")
    return host == "localhost" or host == "::1" or host.startswith("127.")


def endpoint_from(text, seconds):
    """An endpoint as given, or read from the file of that name once it exists (a server writes its own to OUT/endpoint)."""
    if text.startswith("tcp://"):
        return text
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        try:
            with open(text, encoding="ascii") as file:
                found = file.read().strip()
            if found:
                return found
        except FileNotFoundError:
            pass
        time.sleep(0.05)
    raise EnvironmentFailed(f"no endpoint in {text} after {seconds:g} s: is the continuum running?")
