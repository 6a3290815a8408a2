"""Conversations with a lane: what breaks it costs the lane, never a message."""

import socket
import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest

from coupler_protocol.process.interrupt import StopRequest
from coupler_protocol.scene.scene import Link
from coupler_protocol.wire import link_inproc, link_tcp, messages
from coupler_protocol.wire.clocks import Clocks
from coupler_protocol.wire.frames import HEADER
from coupler_protocol.wire.handshake import _wants_lane, join, takes_lanes, welcome_all
from coupler_protocol.wire.lane_door import Door, enter
from coupler_protocol.wire.lockstep import Conversation, Hub
from coupler_protocol.wire.payloads import ForceFrame, VelocityFrame

END = {"report": {}, "stages": []}
RIM = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def scene(lane=None):
    link = Link(lane=lane, timeout=0.3, give_up=5.0, step=50.0, farewell=50.0)
    return SimpleNamespace(link=link, coupling=SimpleNamespace(exchange_every=1), resolved=dict)


class Pair:
    """Both sides of a run with one window after the handshake."""

    def __init__(self, kind, lane=None):
        about = scene(lane)
        if kind == "tcp":
            self.hub_end = link_tcp.HubTransport("tcp://127.0.0.1:*")
            self.end = link_tcp.RankTransport(self.hub_end.endpoint)
        else:
            self.hub_end, (self.end,) = link_inproc.transports(1)
        clocks = Clocks(about.link)
        self.hub = Hub(self.hub_end, [1], clocks, StopRequest())
        self.grid, self.discs = self.hub.conversations[1], Conversation(self.end, 1, 0, clocks, StopRequest())
        thread = threading.Thread(target=lambda: (welcome_all(self.hub, about, {1: RIM}), self.hub_end.receive(0.0)))
        thread.start()
        join(self.discs, about)
        thread.join()
        if kind != "tcp":
            self.hub_end.users[0] = threading.current_thread()  # the thread that welcomed has ended, this one goes on
        self.force, self.velocity = ForceFrame(self.discs, len(RIM)), VelocityFrame(self.grid, len(RIM))
        self.discs.sequence = 1

    def turns(self, numbers):
        """Steps with these numbers, each side in a thread of its own; the last numbers that arrived on either side."""
        forces, velocities = [], []
        self.grid.sequence = self.discs.sequence = numbers[0]

        def discs():
            for number in numbers:
                self.force.values[:], self.force.scalars[:] = number, 0.5
                self.discs.send_step(self.force)
                self.velocity.accept(self.discs.receive((messages.VELOCITY,))[1])
                velocities.append(self.velocity.values[-1])
            self.discs.send_control(messages.FAREWELL, END)

        beside = threading.Thread(target=discs)
        beside.start()
        answer = VelocityFrame(self.grid, len(RIM))
        heard = ForceFrame(self.grid, len(RIM))
        for number in numbers:
            heard.accept(self.grid.receive((messages.FORCE,))[1])
            forces.append(heard.values[-1])
            answer.values[:], answer.scalars[:] = -number, 0.25
            self.grid.send_step(answer)
        self.grid.receive((messages.FAREWELL,))
        beside.join()
        return forces, velocities

    def close(self):
        self.end.close()
        self.hub_end.close()


@pytest.fixture(params=["tcp", "threads"])
def pair(request):
    found = Pair(request.param)
    yield found
    found.close()


def test_steps_take_the_lane(pair):
    assert pair.hub_end.lanes.whole
    assert pair.end.lanes.whole
    assert pair.turns([5, 6, 7]) == ([5, 6, 7], [-5, -6, -7])
    assert pair.hub_end.lanes.whole


def test_a_scene_can_forbid_the_lane():
    pair = Pair("tcp", lane=False)
    assert pair.hub_end.lanes is pair.end.lanes is None
    assert pair.turns([5]) == ([5], [-5])
    pair.close()


def test_a_link_through_a_relay_gets_no_lane():
    """The discrete side says to which port it is connected: not to that of the continuum."""
    hub = SimpleNamespace(local=True, port=5555)
    assert [_wants_lane({"lane": port}, scene(), hub) for port in (5555, 5556)] == [True, False]
    assert _wants_lane({"lane": 5556}, scene(True), hub)
    assert not _wants_lane({}, scene(True), hub)


def test_other_machines_get_no_lane_unless_the_scene_says_so():
    near, far = SimpleNamespace(local=True), SimpleNamespace(local=False)
    assert [takes_lanes(scene(), end) for end in (near, far)] == [True, False]
    assert [takes_lanes(scene(True), end) for end in (near, far)] == [True, True]
    assert [takes_lanes(scene(False), end) for end in (near, far)] == [False, False]


@pytest.mark.parametrize("side", ["end", "hub_end"])
@pytest.mark.parametrize("foreign", [b"", b"GET / HTTP/1.1\r\n\r\n" * 20])
def test_a_lane_that_ends_or_says_something_else_is_closed_and_the_link_goes_on(pair, side, foreign):
    assert pair.turns([5]) == ([5], [-5])
    lanes = getattr(pair, side).lanes
    lanes.sockets[0].setblocking(True)
    lanes.sockets[0].sendall(foreign)
    if not foreign:
        lanes.sockets[0].shutdown(socket.SHUT_RDWR)
    assert pair.turns([8, 9, 10]) == ([8, 9, 10], [-8, -9, -10])
    assert not (pair.end.lanes.whole and pair.hub_end.lanes.whole)


def test_late_and_doubled_frames_on_the_lane_change_nothing(pair):
    assert pair.turns([5]) == ([5], [-5])
    pair.end.lanes.send(pair.force.seal(5), 0)
    pair.end.lanes.send(pair.force.seal(4), 0)
    assert pair.turns([8, 9]) == ([8, 9], [-8, -9])
    assert pair.hub_end.lanes.whole


def test_a_message_sent_again_during_a_long_silence_does_not_cost_the_lane(pair):
    """As while the continuum compiles a kernel: the copy on the link is read first, the one on the lane is the same message."""
    assert pair.turns([5]) == ([5], [-5])
    pair.grid.sequence = pair.discs.sequence = 8
    pair.discs.send_step(pair.force)
    pair.discs.send_again()
    _, frame = pair.grid.receive((messages.FORCE,))
    assert np.frombuffer(frame[HEADER.size :])[-1] == 5.0
    pair.grid.send_step(VelocityFrame(pair.grid, len(RIM)))
    assert pair.discs.receive((messages.VELOCITY,))
    assert pair.hub_end.lanes.whole
    assert pair.end.lanes.whole
    assert pair.turns([9, 10]) == ([9, 10], [-9, -10])
    assert pair.hub_end.lanes.whole


def test_a_message_on_the_link_alone_closes_the_lane(pair):
    assert pair.turns([5]) == ([5], [-5])
    pair.grid.sequence = pair.discs.sequence = 8
    pair.end.send(pair.force.seal(8), 0)
    assert pair.grid.receive((messages.FORCE,))
    assert not pair.hub_end.lanes.whole


def test_a_frame_damaged_on_the_lane_is_sent_again(pair):
    assert pair.turns([5]) == ([5], [-5])
    pair.grid.sequence = pair.discs.sequence = 8
    good = pair.force.seal(8)
    damaged = bytearray(good)
    damaged[100] ^= 4
    pair.discs._last = bytes(good)
    pair.end.lanes.send(damaged, 0)
    beside = threading.Thread(target=lambda: (time.sleep(0.5), pair.discs.send_again()))
    beside.start()
    _, frame = pair.grid.receive((messages.FORCE,))
    beside.join()
    assert np.frombuffer(frame[HEADER.size :])[-1] == 5.0
    assert pair.grid.refused == 1


@pytest.mark.parametrize("side", ["grid", "discs"])
def test_a_message_that_came_on_both_ways_costs_no_lane(pair, side):
    """As after a stop of one side that was longer than a time-out: what was sent again waits beside the frame on the lane."""
    assert pair.turns([5]) == ([5], [-5])
    if side == "grid":
        pair.grid.sequence = pair.discs.sequence = 8
        pair.discs.send_step(pair.force)
        pair.discs.send_again()
        time.sleep(0.1)
        assert pair.grid.receive((messages.FORCE,))[0] == messages.FORCE
        pair.grid.send_step(pair.velocity)
        pair.discs.receive((messages.VELOCITY,))
    else:
        pair.grid.sequence = pair.discs.sequence = 8
        pair.grid.send_step(pair.velocity)
        pair.grid.send_again()
        time.sleep(0.1)
        assert pair.discs.receive((messages.VELOCITY,))[0] == messages.VELOCITY
    assert pair.turns([11, 12]) == ([11, 12], [-11, -12])
    assert pair.hub_end.lanes.whole
    assert pair.end.lanes.whole


def test_a_lane_that_ends_after_the_last_step_is_not_told(pair, caplog):
    """The discrete side closes its end as soon as it has said farewell."""
    pair.grid.sequence = pair.discs.sequence = 8
    pair.grid.end_steps("done")
    assert pair.discs.receive((messages.VELOCITY, messages.STOP))[0] == messages.STOP
    pair.discs.send_control(messages.FAREWELL, END)
    pair.end.lanes.close_all()
    assert pair.grid.receive((messages.FAREWELL,))[0] == messages.FAREWELL
    assert not pair.hub_end.lanes.look()
    assert not pair.hub_end.lanes.whole
    assert caplog.text == ""


# -- the door ------------------------------------------------------------------------------------------------------------


def test_the_door_lets_in_who_knows_the_token_and_nobody_else():
    door = Door("127.0.0.1")
    port = door.offer["port"]
    results = {}

    def strangers():
        silent = socket.create_connection(("127.0.0.1", port))
        silent.sendall(b"x" * 64)
        results["wrong"] = enter("127.0.0.1", {"port": port, "token": b"0" * 32})
        results["right"] = enter("127.0.0.1", door.offer)
        silent.close()

    beside = threading.Thread(target=strangers)
    beside.start()
    found = door.admit(lambda: None)
    beside.join()
    assert results["wrong"] is None
    assert results["right"] is not None
    found.sendall(b"hello")
    assert results["right"].recv(5) == b"hello"
    with pytest.raises(OSError, match="refused"):
        socket.create_connection(("127.0.0.1", port), timeout=1.0)
    found.close()
    results["right"].close()


def test_nobody_comes_and_nobody_is_there():
    door = Door("127.0.0.1")
    assert door.admit(lambda: None, seconds=0.3) is None
    assert enter("127.0.0.1", door.offer, seconds=0.5) is None
    assert enter("127.0.0.1", door.offer | {"port": 1 << 40}, seconds=0.5) is None  # no port


def test_who_took_the_port_gets_no_steps():
    """A server that does not know the token is refused by the discrete side."""
    with socket.create_server(("127.0.0.1", 0)) as impostor:

        def answer():
            connection, _ = impostor.accept()
            connection.sendall(b"n" * 32 + b"p" * 32)
            time.sleep(0.3)
            connection.close()

        beside = threading.Thread(target=answer)
        beside.start()
        assert enter("127.0.0.1", {"port": impostor.getsockname()[1], "token": b"t" * 32}) is None
        beside.join()
