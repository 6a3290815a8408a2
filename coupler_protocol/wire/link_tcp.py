"""Transport with ZeroMQ: the continuum binds a ROUTER, each discrete process connects a DEALER.

ZeroMQ itself uses only Unix sockets in folders of their user. Over TCP, a gate is in front of the ROUTER (gate.py) and a passage
behind the DEALER (passage.py): both prove themselves before ZeroMQ gets a byte. With keys, ZeroMQ encrypts what goes through
(CURVE) and asks for the key once more (ZAP). Two processes of one user on one machine can also do without TCP (`local`).

A transport transmits frames between ranks, whatever their content:

    send(frame, rank)             sends a frame to the peer (dropped without a peer: the conversation sends it again)
    receive(seconds)              (sender, frame) or None; the frame is valid until the next call
    proves                        whether only those speak who have proved that they may
    lanes                         Lanes of step messages (lanes.py), whose frames `receive` also finds, or None
    admit(sender, rank)           assigns later frames of this sender to `rank`
    connected(rank)               whether a peer is connected, according to the last frames
    departed(rank)                whether a peer can never come back (threads only)
    close()

`link_inproc` has the same for two threads of one process.
"""

import contextlib
import ipaddress
import logging
import os
import re
import socket
import stat
import struct
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import zmq
from zmq.utils import z85

from coupler_protocol.exits import EnvironmentFailed
from coupler_protocol.wire.admission import Pass, Rule, local_pass, local_rule
from coupler_protocol.wire.frames import MAX_FRAME, Buffer
from coupler_protocol.wire.gate import BACKLOG, Gate
from coupler_protocol.wire.gate_words import OPEN
from coupler_protocol.wire.lane_door import Door, enter
from coupler_protocol.wire.lanes import Lanes
from coupler_protocol.wire.passage import Passage
from coupler_protocol.wire.socket_folder import SocketFolder

log = logging.getLogger(__name__)

HEARTBEAT, HEARTBEAT_TIMEOUT, LINGER = 1000, 5000, 1000  # ms
# One message is under way at a time, but ZeroMQ frees the room of delivered messages late and in batches: with room for 8, a
# send that must not block sometimes finds the queue full, the message is dropped, and the step costs a time-out.
HIGH_WATER = 1000
# A sleeping thread is woken late, several times a step. So a waiting side stays awake for this time [s] and yields the processor
# to other threads (mainly that of ZeroMQ): this reduced a round trip from 170 to 75 us.
AWAKE = 5e-4
MAX_PORT = 65535
_MONITORED = struct.Struct("=hi")  # event and its value, first frame of a monitor's message: zmq_socket_monitor(3)
LOCAL = "local"  # address of a continuum that only processes of its user on its machine can reach
DOMAIN = "colluvium"  # of ZAP
HANDSHAKE = 5000  # ms
# First byte of the routing ids that ZeroMQ makes: of clients without one, and of what a broken connection still carried when its
# process came back. Such a HELLO would claim the rank for a name that nobody can answer; the process sends it again in its own.
NAMELESS = b"\0"
_REFUSALS = zmq.EVENT_HANDSHAKE_FAILED_AUTH | zmq.EVENT_HANDSHAKE_FAILED_PROTOCOL  # after which ZeroMQ does not try again
# No more events than needed: a full monitor stops ZeroMQ's thread.
_EVENTS = zmq.EVENT_HANDSHAKE_SUCCEEDED | zmq.EVENT_DISCONNECTED | _REFUSALS


class _Socket:
    """Common part of both ends: options, the folder of its Unix socket, and the buffer for received frames."""

    def __init__(self, kind: int, endpoint: str) -> None:
        self.context = zmq.Context()
        self.socket = self.context.socket(kind)
        s = self.socket
        s.sndhwm = s.rcvhwm = HIGH_WATER
        s.linger = LINGER
        s.maxmsgsize = MAX_FRAME
        if not os.environ.get("COLLUVIUM_NO_HEARTBEAT"):  # for breakpoints in a debugger
            s.heartbeat_ivl, s.heartbeat_timeout = HEARTBEAT, HEARTBEAT_TIMEOUT
        # Room for the largest frame, so that none is truncated; the system allocates memory only for the part that is used.
        self._buffer = np.empty(MAX_FRAME, np.uint8).data
        self._timeout: float | None = None
        self.lanes: Lanes | None = None  # set by the handshake
        self.proves = True
        self.endpoint = endpoint
        self._folder = SocketFolder()
        self.folder = self._folder.path
        self._guard: Gate | Passage | None = None

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

    def _attempt(self, call: Callable[[], Any], doing: str) -> Any:
        """Result of `call()`; closes this end and raises EnvironmentFailed if its address cannot be used."""
        try:
            return call()
        except (zmq.ZMQError, OSError, ValueError) as error:
            self.close()
            why = getattr(error, "strerror", None) or error
            raise EnvironmentFailed(f"cannot {doing} {self.endpoint}: {why}") from None
        except EnvironmentFailed:
            self.close()
            raise

    @property
    def port(self) -> int:
        """Port of the endpoint, 0 without TCP."""
        return 0 if _unix(self.endpoint) else host_and_port(self.endpoint)[1]

    @property
    def local(self) -> bool:
        """Whether both ends are on one machine."""
        return is_loopback(self.endpoint)

    @property
    def _place(self) -> str:
        """Where lanes are opened (lane_door.py): host, or folder of the Unix socket."""
        return os.path.dirname(_unix(self.endpoint)) or host_and_port(self.endpoint)[0]

    @property
    def trouble(self) -> str:
        """Why the continuum is not connected, if this side knows; "" at the continuum, whose gate logs it."""
        return self._guard.trouble if isinstance(self._guard, Passage) else ""

    def departed(self, rank: int) -> bool:
        """Never: a process can come back, and others can follow it."""
        return False

    def close(self) -> None:
        """Closes the socket and all lanes; waiting frames have one second to be sent."""
        if self.lanes is not None:
            self.lanes.close_all()
        self.socket.close()
        self.context.term()
        if self._guard is not None:
            self._guard.close()
        self._folder.remove()


class HubTransport(_Socket):
    """End of the continuum: listens, and has for each rank the routing id of the process that claimed it.

    endpoint: tcp://HOST:PORT or LOCAL; rule: who may pass the gate of a TCP address, by default processes of this user.
    """

    def __init__(self, endpoint: str, rule: Rule | None = None) -> None:
        super().__init__(zmq.ROUTER, endpoint)
        self.socket.router_handover = True
        self.socket.router_mandatory = True  # a frame for a peer that has gone is an error, not silence
        self.socket.handshake_ivl = HANDSHAKE
        self._route: dict[int, bytes] = {}
        self._rank: dict[bytes, int] = {}
        self._user: dict[int, str] = {}  # with CURVE: public keys (Z85 text) of the ranks
        self._heard: tuple[bytes, str] = (b"", "")  # routing id and user of the last frame
        self._gone: set[Any] = set()
        self._authenticator: Any = None
        inside = f"{self.folder}/link"
        if endpoint == LOCAL:
            self.endpoint = f"ipc://{inside}"
            self._attempt(lambda: self.socket.bind(self.endpoint), "listen on")
            return
        listener = self._attempt(lambda: listening_socket(*host_and_port(endpoint)), "listen on")
        with contextlib.ExitStack() as undo:
            undo.callback(listener.close)
            rule = self._attempt(local_rule, "listen on") if rule is None else rule
            self.proves = rule.kind != OPEN
            self._encrypt(rule)
            self._attempt(lambda: self.socket.bind(f"ipc://{inside}"), "listen on")
            undo.pop_all()
        self.endpoint = _endpoint_of(listener)
        self._guard = Gate(listener, inside, rule, self._cut_lanes)

    def _encrypt(self, rule: Rule) -> None:
        """With keys: CURVE, and a handler of ZAP that admits the keys of the rule, before anything is bound."""
        if rule.curve is None:
            return
        from zmq.auth.thread import ThreadAuthenticator  # loads asyncio

        self._authenticator = ThreadAuthenticator(self.context)
        self._authenticator.start()
        self._authenticator.configure_curve_callback(DOMAIN, _Listed(rule))
        self.socket.zap_domain = DOMAIN.encode()
        self.socket.setsockopt(zmq.ZAP_ENFORCE_DOMAIN, 1)  # without a handler nobody is admitted
        self.socket.curve_server = True
        self.socket.curve_publickey, self.socket.curve_secretkey = rule.curve

    def _cut_lanes(self, public: bytes) -> None:
        """Ends the lanes of a client whose key was revoked; called in the gate's thread."""
        user, lanes = z85.encode(public).decode(), self.lanes
        for rank, theirs in list(self._user.items()):
            found = lanes.sockets[lanes.row[rank]] if lanes is not None and theirs == user else None
            if found is not None:
                with contextlib.suppress(OSError):
                    found.shutdown(socket.SHUT_RDWR)

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
            first = self.socket.recv(0 if self.lanes is None else zmq.NOBLOCK, copy=self._authenticator is None)
        except zmq.Again:
            return None
        sender = first if isinstance(first, bytes) else first.bytes
        frame = self._take()
        while self.socket.getsockopt(zmq.RCVMORE):
            self.socket.recv()
        if sender.startswith(NAMELESS):
            return None
        rank = self._rank.get(sender)
        if not isinstance(first, bytes):
            self._heard = (sender, str(first.get("User-Id")))
            if rank is not None and self._user[rank] != self._heard[1]:
                log.warning("a message in the name of rank %d came with another key and was refused", rank)
                return None
        return (sender if rank is None else rank), frame

    def admit(self, sender: Any, rank: int) -> None:
        """Assigns `rank` to the sender's routing id and the key of its last frame; the earlier process of the rank loses it."""
        self._rank = {s: r for s, r in self._rank.items() if r != rank}
        self._route[rank], self._rank[sender] = sender, rank
        self._user[rank] = self._heard[1]
        self._gone.discard(rank)

    def connected(self, rank: int) -> bool:
        """Whether the last frame for `rank` had a receiver."""
        return rank in self._route and rank not in self._gone

    def door(self) -> Door:
        """A Door for the lane of a discrete process, at the address of the link."""
        return Door(self._place)

    def close(self) -> None:
        """Closes the socket and all lanes; waiting frames have one second to be sent."""
        if self._authenticator is not None:
            self._authenticator.stop()
            self._authenticator = None
        super().close()


class _Listed:
    """Answers ZAP: whether a rule has a key; what the gate has admitted is asked again by its CURVE key."""

    def __init__(self, rule: Any) -> None:
        self.rule = rule

    def callback(self, domain: str, key: bytes) -> bool:
        """Whether a client with this public key (Z85 text) is admitted."""
        try:
            listed = not self.rule.revoked(z85.decode(key))
        except EnvironmentFailed as error:
            log.warning("a key cannot be checked: %s", error)
            return False
        if not listed:
            log.warning("a client was refused: its key is not on the list")
        return listed


def _event_in(message: list[bytes]) -> int:
    """Event in a message of a monitor; zmq.utils.monitor has the same, but loads asyncio, which takes a twentieth of a second."""
    return int(_MONITORED.unpack(message[0])[0])


class RankTransport(_Socket):
    """End of a discrete process, with a random routing id. ticket: with what it passes the gate, by default that of this user."""

    def __init__(self, endpoint: str, ticket: Pass | None = None) -> None:
        super().__init__(zmq.DEALER, endpoint)
        self.socket.routing_id = b"\1" + os.urandom(15)
        self.socket.reconnect_ivl, self.socket.reconnect_ivl_max = 100, 1000
        self.monitor = self.socket.get_monitor_socket(_EVENTS)
        self._up = False
        self._next_try = 0.0  # time before which ZeroMQ is not told to try again
        if _unix(endpoint):
            self._attempt(lambda: _check_owner(os.path.dirname(_unix(endpoint))), "connect to")
            self._inside = endpoint
        else:
            self._inside = f"ipc://{self.folder}/passage"
            self._guard = self._attempt(lambda: self._passage(ticket), "connect to")
        self._attempt(lambda: self.socket.connect(self._inside), "connect to")

    def _passage(self, ticket: Pass | None) -> Passage:
        address = host_and_port(self.endpoint)
        ticket = local_pass() if ticket is None else ticket
        if ticket.curve is not None:
            self.socket.curve_serverkey = ticket.curve.server
            self.socket.curve_publickey, self.socket.curve_secretkey = ticket.curve.public, ticket.curve.secret
        listener = socket.socket(socket.AF_UNIX)
        listener.bind(f"{self.folder}/passage")
        listener.listen()
        return Passage(listener, address, self.endpoint, ticket)

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
        return enter(self._place, offer)

    def admit(self, sender: Any, rank: int) -> None:
        """Does nothing: there is only one peer."""

    def connected(self, rank: int = 0) -> bool:
        """Whether the continuum is connected. Raises EnvironmentFailed if it refuses this process for good."""
        while self.monitor.poll(0):
            event = _event_in(self.monitor.recv_multipart())
            self._up = event == zmq.EVENT_HANDSHAKE_SUCCEEDED
            if event & _REFUSALS:
                self._try_again()
        if isinstance(self._guard, Passage) and self._guard.refused:
            raise EnvironmentFailed(self._guard.refused)
        return self._up

    def _try_again(self) -> None:
        """Connects anew, at most once a second: ZeroMQ gives a connection up for ever after a failed handshake."""
        now = time.monotonic()
        if now >= self._next_try:
            self._next_try = now + 1.0
            log.warning("the handshake with the continuum failed: its key or that of this side has changed, or its version")
            self.socket.disconnect(self._inside)
            self.socket.connect(self._inside)

    def close(self) -> None:
        """Closes the socket; waiting frames have one second to be sent."""
        self.socket.disable_monitor()
        self.monitor.close(0)
        super().close()


def listening_socket(host: str, port: int) -> socket.socket:
    """A socket that listens on HOST:PORT; "*" or "0.0.0.0": all addresses."""
    host = "0.0.0.0" if host == "*" else host
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    return socket.create_server((host, port), family=family, backlog=BACKLOG)


def _endpoint_of(listener: socket.socket) -> str:
    """tcp://HOST:PORT of a listening socket."""
    host, port = listener.getsockname()[:2]
    return f"tcp://[{host}]:{port}" if ":" in host else f"tcp://{host}:{port}"


def _unix(endpoint: str) -> str:
    """Path of ipc://PATH, "" for other endpoints."""
    return endpoint.removeprefix("ipc://") if endpoint.startswith("ipc://") else ""


def _check_owner(folder: str) -> None:
    """Raises EnvironmentFailed for a folder that is not of this user only: another user could have put the socket there."""
    about = os.stat(folder)
    if about.st_uid != os.geteuid() or stat.S_IMODE(about.st_mode) & 0o077:
        raise EnvironmentFailed(f"{folder} is not a folder of this user only: a continuum that listens there cannot be trusted")


def host_and_port(endpoint: str) -> tuple[str, int]:
    """HOST and PORT of tcp://HOST:PORT, 0 for any port; raises ValueError."""
    protocol, _, rest = endpoint.partition("://")
    host, _, port = rest.rpartition(":")
    if protocol != "tcp" or not host or not (port == "*" or port.isdecimal()):
        raise ValueError("the address is not of the form tcp://HOST:PORT")
    number = 0 if port == "*" else int(port)
    if number > MAX_PORT:
        raise ValueError(f"there is no port {port}")
    return host.strip("[]"), number


def is_loopback(endpoint: str) -> bool:
    """Whether the endpoint can be reached from this machine only."""
    if endpoint == LOCAL or _unix(endpoint):
        return True
    protocol, _, rest = endpoint.partition("://")
    host = rest.rpartition(":")[0].strip("[]")
    try:
        return protocol == "tcp" and (host == "localhost" or ipaddress.ip_address(host).is_loopback)
    except ValueError:
        return False


def endpoint_from(text: str, seconds: float, check: Callable[[], object] = lambda: None) -> str:
    """Endpoint as given, or from the file of that name as soon as it exists (a server writes its endpoint to OUT/endpoint).

    check(): of the stop request. Raises EnvironmentFailed if there is no endpoint after `seconds` (link.arrival).
    """
    if text.startswith(("tcp://", "ipc://")):
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
        time.sleep(0.01)
    raise EnvironmentFailed(
        f"no endpoint in {text} after {seconds:g} s (link.arrival): start fdm-server with this --out, or give its address"
    )
