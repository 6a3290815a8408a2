"""Transport over TCP with ZeroMQ: the continuum binds a ROUTER, each discrete process connects a DEALER.

A transport transmits frames between ranks, whatever their content:

    send(frame, rank)             sends a frame to the peer (dropped without a peer: the conversation sends it again)
    receive(seconds)              (sender, frame) or None; the frame is valid until the next call
    lanes                         Lanes of step messages (lanes.py), whose frames `receive` also finds, or None
    admit(sender, rank)           assigns later frames of this sender to `rank`
    connected(rank)               whether a peer is connected, according to the last frames
    departed(rank)                whether a peer can never come back (threads only)
    close()

`link_inproc` has the same for two threads of one process.
"""

import contextlib
import ipaddress
import os
import re
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import zmq
from zmq.utils.monitor import recv_monitor_message

from coupler_protocol.exits import EnvironmentFailed
from coupler_protocol.wire.frames import MAX_FRAME, Buffer
from coupler_protocol.wire.lane_door import Door, enter
from coupler_protocol.wire.lanes import Lanes

HEARTBEAT, HEARTBEAT_TIMEOUT, LINGER = 1000, 5000, 1000  # ms
# One message is under way at a time, but ZeroMQ frees the room of delivered messages late and in batches: with room for 8, a
# send that must not block sometimes finds the queue full, the message is dropped, and the step costs a time-out.
HIGH_WATER = 1000
# A sleeping thread is woken late, several times a step. So a waiting side stays awake for this time [s] and yields the processor
# to other threads (mainly that of ZeroMQ): this reduced a round trip from 170 to 75 us.
AWAKE = 5e-4
MAX_PORT = 65535
_EVENTS = zmq.EVENT_HANDSHAKE_SUCCEEDED | zmq.EVENT_DISCONNECTED  # no more than needed: a full monitor stops ZeroMQ's thread


class _Socket:
    """Common part of both ends: options, and the buffer for received frames."""

    def __init__(self, kind: int, endpoint: str) -> None:
        self.context = zmq.Context()
        self.socket = self.context.socket(kind)
        s = self.socket
        s.sndhwm = s.rcvhwm = HIGH_WATER
        s.linger = LINGER
        s.maxmsgsize = MAX_FRAME
        s.ipv6 = "[" in endpoint
        if not os.environ.get("COLLUVIUM_NO_HEARTBEAT"):  # for breakpoints in a debugger
            s.heartbeat_ivl, s.heartbeat_timeout = HEARTBEAT, HEARTBEAT_TIMEOUT
        # Room for the largest frame, so that none is truncated; the system allocates memory only for the part that is used.
        self._buffer = np.empty(MAX_FRAME, np.uint8).data
        self._timeout: float | None = None
        self.lanes: Lanes | None = None  # set by the handshake
        self.endpoint = endpoint

    def _await(self, seconds: float) -> tuple[int, memoryview] | None:
        """Waits for a frame on either way; returns (rank, frame) of a lane, None if the link has one or none came."""
        assert self.lanes is not None
        until = time.perf_counter() + AWAKE
        while True:
            if int(self.socket.getsockopt(zmq.EVENTS)) & zmq.POLLIN:  # first, so that strangers are answered during the steps
                return None
            found = self.lanes.look()
            if found is not None:
                return found
            if time.perf_counter() > until:
                break
            os.sched_yield()
        poller = zmq.Poller()
        for way in (self.socket, *filter(None, self.lanes.sockets)):
            poller.register(way, zmq.POLLIN)
        poller.poll(int(1000 * seconds))
        return self.lanes.look()

    def _wait(self, seconds: float) -> None:
        if seconds != self._timeout:
            self.socket.rcvtimeo = max(1, int(seconds * 1000))
            self._timeout = seconds

    def _stay_awake(self) -> None:
        """Returns as soon as a frame is available, or after a short time without one."""
        until = time.perf_counter() + AWAKE
        while not int(self.socket.getsockopt(zmq.EVENTS)) & zmq.POLLIN and time.perf_counter() < until:
            os.sched_yield()

    def _take(self, flags: int = 0) -> memoryview:
        """The next frame, in a buffer that is reused."""
        return self._buffer[: self.socket.recv_into(self._buffer, flags=flags)]

    def _open(self, call: Callable[[str], Any], endpoint: str, doing: str) -> None:
        port = endpoint.rpartition(":")[2]
        try:
            if port.isdecimal() and int(port) > MAX_PORT:  # ZeroMQ would take another one without a word
                raise ValueError(f"there is no port {port}")
            call(endpoint)
        except (zmq.ZMQError, ValueError) as error:
            self.close()
            raise EnvironmentFailed(f"cannot {doing} {endpoint}: {error}") from None

    @property
    def port(self) -> int:
        """Port of the endpoint."""
        return int(self.endpoint.rpartition(":")[2])

    @property
    def local(self) -> bool:
        """Whether both ends are on one machine."""
        return is_loopback(self.endpoint)

    def departed(self, rank: int) -> bool:
        """Never: a process can come back, and others can follow it."""
        return False

    def close(self) -> None:
        """Closes the socket and all lanes; waiting frames have one second to be sent."""
        if self.lanes is not None:
            self.lanes.close_all()
        self.socket.close()
        self.context.term()


class HubTransport(_Socket):
    """End of the continuum: listens, and has for each rank the routing id of the process that claimed it."""

    def __init__(self, endpoint: str) -> None:
        super().__init__(zmq.ROUTER, endpoint)
        self.socket.router_handover = True
        self.socket.router_mandatory = True  # a frame for a peer that has gone is an error, not silence
        self._open(self.socket.bind, endpoint, "listen on")
        self.endpoint = self.socket.getsockopt_string(zmq.LAST_ENDPOINT).rstrip("\0")
        self._route: dict[int, bytes] = {}
        self._rank: dict[bytes, int] = {}
        self._gone: set[Any] = set()

    def send(self, frame: Buffer, rank: Any) -> None:
        """Sends to the process of `rank`, or to a sender that is not admitted yet."""
        route = self._route.get(rank, rank)
        if isinstance(route, int):  # no process has this rank
            return
        try:
            self.socket.send_multipart([route, frame], zmq.NOBLOCK)
            self._gone.discard(rank)
        except zmq.Again:
            pass
        except zmq.ZMQError as error:
            if error.errno != zmq.EHOSTUNREACH:
                raise
            if rank in self._route:
                self._gone.add(rank)

    def receive(self, seconds: float) -> tuple[Any, Buffer] | None:
        """Waits for a frame; returns (rank, or routing id of a sender without rank; frame), or None after `seconds`."""
        if self.lanes is None:
            self._wait(seconds)
            self._stay_awake()
        elif (found := self._await(seconds)) is not None:
            return found
        try:
            sender = self.socket.recv(0 if self.lanes is None else zmq.NOBLOCK)
        except zmq.Again:
            return None
        frame = self._take()
        while self.socket.getsockopt(zmq.RCVMORE):
            self.socket.recv()
        return self._rank.get(sender, sender), frame

    def admit(self, sender: Any, rank: int) -> None:
        """Assigns `rank` to the sender's routing id; the earlier process of the rank loses it."""
        self._rank = {s: r for s, r in self._rank.items() if r != rank}
        self._route[rank], self._rank[sender] = sender, rank
        self._gone.discard(rank)

    def connected(self, rank: int) -> bool:
        """Whether the last frame for `rank` had a receiver."""
        return rank in self._route and rank not in self._gone

    def door(self) -> Door:
        """A Door for the lane of a discrete process, at the address of the link."""
        return Door(_host(self.endpoint))


class RankTransport(_Socket):
    """End of a discrete process, with a random routing id."""

    def __init__(self, endpoint: str) -> None:
        super().__init__(zmq.DEALER, endpoint)
        self.socket.routing_id = b"\1" + os.urandom(15)
        self.socket.reconnect_ivl, self.socket.reconnect_ivl_max = 100, 1000
        self.monitor = self.socket.get_monitor_socket(_EVENTS)
        self._up = False
        self._open(self.socket.connect, endpoint, "connect to")
        self.endpoint = endpoint

    def send(self, frame: Buffer, rank: Any = 0) -> None:
        """Sends to the continuum."""
        with contextlib.suppress(zmq.Again):
            self.socket.send(frame, zmq.NOBLOCK)

    def receive(self, seconds: float) -> tuple[Any, Buffer] | None:
        """Waits for a frame; returns (0, frame), or None after `seconds` without one."""
        if self.lanes is None:
            self._wait(seconds)
            self._stay_awake()
        elif (found := self._await(seconds)) is not None:
            return 0, found[1]
        try:
            return 0, self._take(0 if self.lanes is None else zmq.NOBLOCK)
        except zmq.Again:
            return None

    def enter(self, offer: dict[str, Any]) -> Any:
        """Connection through a Door of the continuum, or None."""
        return enter(_host(self.endpoint), offer)

    def admit(self, sender: Any, rank: int) -> None:
        """Does nothing: there is only one peer."""

    def connected(self, rank: int = 0) -> bool:
        """Whether the continuum is connected."""
        while self.monitor.poll(0):
            self._up = recv_monitor_message(self.monitor)["event"] == zmq.EVENT_HANDSHAKE_SUCCEEDED
        return self._up

    def close(self) -> None:
        """Closes the socket; waiting frames have one second to be sent."""
        self.socket.disable_monitor()
        self.monitor.close(0)
        super().close()


def _host(endpoint: str) -> str:
    """HOST of tcp://HOST:PORT."""
    return endpoint.partition("://")[2].rpartition(":")[0].strip("[]")


def any_port(endpoint: str) -> str:
    """Endpoint by which ZeroMQ chooses a free port, for tcp://HOST:0; other endpoints unchanged."""
    return endpoint[:-1] + "*" if endpoint.endswith(":0") else endpoint


def is_loopback(endpoint: str) -> bool:
    """Whether tcp://HOST:PORT names this machine only."""
    protocol = endpoint.partition("://")[0]
    host = _host(endpoint)
    try:
        return protocol == "tcp" and (host == "localhost" or ipaddress.ip_address(host).is_loopback)
    except ValueError:
        return False


def endpoint_from(text: str, seconds: float, check: Callable[[], object] = lambda: None) -> str:
    """Endpoint as given, or from the file of that name as soon as it exists (a server writes its endpoint to OUT/endpoint).

    check(): of the stop request. Raises EnvironmentFailed if there is no endpoint after `seconds` (link.arrival).
    """
    if text.startswith("tcp://"):
        return text
    if re.fullmatch(r"[^/]+:\d+", text):
        return "tcp://" + text
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        try:
            with open(text, encoding="ascii", errors="replace") as file:
                found = file.read().strip()
            if found:
                return found
        except FileNotFoundError:
            pass
        check()
        time.sleep(0.05)
    raise EnvironmentFailed(
        f"no endpoint in {text} after {seconds:g} s (link.arrival): start fdm-server with this --out, or give its address"
    )
