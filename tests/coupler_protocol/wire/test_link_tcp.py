"""Frames over TCP on this machine: who is connected, who may claim a rank, and what strangers cannot do."""

import signal
import socket
import subprocess
import time

import numpy as np
import pytest
import zmq

from coupler_protocol.exits import EnvironmentFailed, PeerLost
from coupler_protocol.process.interrupt import StopRequest
from coupler_protocol.wire import frames, link_tcp
from coupler_protocol.wire.lockstep import Conversation, Hub
from coupler_protocol.wire.messages import FORCE, GO, HELLO, PACKED, REJECT, VELOCITY
from tests.commands import command, finished
from tests.scripted_peer import SESSION, Beside, Peer, clocks

ANY = "tcp://127.0.0.1:*"


@pytest.fixture
def lines():
    """A function that opens the continuum's end and any number of discrete ends; all are closed afterwards."""
    opened = []

    def add(transport):
        opened.append(transport)
        return transport

    def open_lines(count):
        hub = add(link_tcp.HubTransport(ANY))
        return hub, [add(link_tcp.RankTransport(hub.endpoint)) for _ in range(count)]

    open_lines.add = add
    yield open_lines
    for transport in reversed(opened):
        if not transport.socket.closed:
            transport.socket.linger = 0
            transport.close()


def introduce(hub, end, rank):
    """Let the hub know an end as `rank`."""
    end.send(b"hello")
    sender, _ = hub.receive(5.0)
    hub.admit(sender, rank)


def conversations(hub_end, end, **times):
    """Both sides of rank 1, in the middle of a session."""
    hub = Hub(hub_end, (1,), clocks(**times), StopRequest())
    introduce(hub_end, end, 1)
    talk = Conversation(end, 1, 0, clocks(**times), StopRequest())
    for side in (hub.conversations[1], talk):
        side.begin(SESSION)
    return hub.conversations[1], talk


def test_frames_cross_in_both_directions_and_know_their_rank(lines):
    hub, ends = lines(2)
    for rank, end in enumerate(ends, start=1):
        introduce(hub, end, rank)
    for rank, end in enumerate(ends, start=1):
        hub.send(b"to %d" % rank, rank)
        assert bytes(end.receive(5.0)[1]) == b"to %d" % rank
        end.send(b"from %d" % rank)
        sender, frame = hub.receive(5.0)
        assert (sender, bytes(frame)) == (rank, b"from %d" % rank)
    assert hub.receive(0.01) is None
    assert ends[0].receive(0.01) is None


@pytest.mark.parametrize("size", [0, 1, (1 << 20) + 1, 5 << 20])
def test_frames_of_all_sizes_arrive_whole_at_the_first_try(lines, size):
    hub, (end,) = lines(1)
    introduce(hub, end, 1)
    content = np.random.default_rng(1).bytes(size)
    end.send(content)
    assert bytes(hub.receive(10.0)[1]) == content
    hub.send(content, 1)
    assert bytes(end.receive(10.0)[1]) == content


def test_a_thousand_steps_keep_every_bit_and_say_nothing_twice(lines):
    hub_end, (end,) = lines(1)
    grid, discs = conversations(hub_end, end, timeout=10.0, give_up=30.0)
    numbers = np.random.default_rng(1).standard_normal((1000, 40))
    there, here = (frames.StepFrame(FORCE, SESSION, 1, 0, 40) for _ in range(2))
    back = frames.StepFrame(VELOCITY, SESSION, 1, 0, 40)

    def answer():
        for _ in numbers:
            here.accept(grid.receive((FORCE,))[1])
            back.values[:] = here.values
            grid.send_step(back)

    got = frames.StepFrame(VELOCITY, SESSION, 1, 0, 40)
    with Beside(answer):
        for row in numbers:
            there.values[:] = row
            discs.send_step(there)
            got.accept(discs.receive((VELOCITY,))[1])
            assert got.values.tobytes() == row.tobytes()
    assert grid.repeated == discs.repeated == grid.refused == discs.refused == 0


# -- who is there --------------------------------------------------------------------------------------------------------


def test_a_discrete_process_that_closes_is_given_up(lines):
    hub_end, (end,) = lines(1)
    grid, discs = conversations(hub_end, end, timeout=0.2, give_up=0.6)
    grid.send_control(GO, {})
    discs.receive((GO,))
    assert hub_end.connected(1)
    end.close()
    begin = time.monotonic()
    with pytest.raises(PeerLost, match="rank 1 was lost: not connected"):
        grid.receive((FORCE,))
    assert time.monotonic() - begin > 0.5
    assert not hub_end.connected(1)


def test_a_continuum_that_closes_is_given_up(lines):
    hub_end, (end,) = lines(1)
    grid, discs = conversations(hub_end, end, timeout=0.2, give_up=0.6)
    grid.send_control(GO, {})
    discs.receive((GO,))
    assert end.connected()
    hub_end.close()
    begin = time.monotonic()
    with pytest.raises(PeerLost, match="the continuum was lost: not connected"):
        discs.receive((VELOCITY,))
    assert time.monotonic() - begin > 0.5
    assert not end.connected()


def test_one_lost_process_of_two_is_the_one_that_is_named(lines):
    hub_end, ends = lines(2)
    hub = Hub(hub_end, (1, 2), clocks(0.2, 0.6), StopRequest())
    for rank, end in enumerate(ends, start=1):
        introduce(hub_end, end, rank)
        hub.conversations[rank].begin(SESSION)
        hub.conversations[rank].send_control(GO, {})
    ends[1].close()
    with pytest.raises(PeerLost, match="rank 2 was lost"):
        hub.conversations[2].receive((FORCE,))
    assert hub.conversations[1].send_again()


def test_a_line_that_breaks_and_comes_back_costs_nothing_but_time(lines):
    """The continuum's port closes and opens again, as when a cable is pulled and put back."""
    hub_end, (end,) = lines(1)
    grid, discs = conversations(hub_end, end, timeout=0.2, give_up=20.0)
    sender = hub_end._route[1]
    hub_end.close()
    again = lines.add(link_tcp.HubTransport(hub_end.endpoint))
    again.admit(sender, 1)
    grid.transport = again
    discs.send_control(PACKED, {"discs": 5})
    _, frame = grid.receive((PACKED,))
    assert frames.content_of(frame) == {"discs": 5}


# -- strangers -----------------------------------------------------------------------------------------------------------


def test_what_a_broken_connection_still_carried_does_not_come_from_a_stranger():
    """A HELLO that was not read yet when its connection broke must not claim the rank in a name that nobody can answer."""
    hub, context, name = link_tcp.HubTransport(link_tcp.LOCAL), zmq.Context(), b"\1" + bytes(15)
    try:
        for text in (b"HELLO", b"HELLO again"):
            end = context.socket(zmq.DEALER)
            end.routing_id, end.linger = name, 5000
            end.connect(hub.endpoint)
            end.send(text)
            time.sleep(0.3)
            if text == b"HELLO":
                end.close()
                time.sleep(0.3)
        found = [(sender, bytes(frame)) for sender, frame in filter(None, (hub.receive(0.5) for _ in range(4)))]
        assert found == [(name, b"HELLO again")]
    finally:
        context.destroy(0)
        hub.close()


def test_a_second_claim_of_a_rank_is_turned_away_while_its_holder_lives(lines):
    hub_end, (holder, thief) = lines(2)
    grid, discs = conversations(hub_end, holder, step=0.3)
    grid.send_control(GO, {})
    discs.receive((GO,))
    claim = Peer(thief, 0, session=0)
    claim.send_control(HELLO, 0, {})
    discs.send_control(PACKED, {})
    time.sleep(0.2)
    assert grid.receive((PACKED,))[0] == PACKED
    with pytest.raises(PeerLost):
        grid.receive((FORCE,))
    answer = claim.receive()
    assert answer.kind == REJECT
    assert "rank 1 is taken and its holder lives" in answer.content["reason"]
    hub_end.send(b"mine", 1)
    while bytes(frame := holder.receive(5.0)[1]) != b"mine":
        assert frames.kind_of(frame) == GO
    assert thief.receive(0.1) is None


def test_port_scans_and_foreign_clients_leave_the_hub_alone(lines):
    hub_end, (end,) = lines(1)
    grid, discs = conversations(hub_end, end)
    port = int(hub_end.endpoint.rpartition(":")[2])
    for greeting in (b"", b"GET / HTTP/1.1\r\n\r\n", b"\xff" + b"\0" * 8 + b"\x01\x7f"):
        with socket.create_connection(("127.0.0.1", port)) as scan:
            scan.sendall(greeting)
    foreign = zmq.Context()
    for parts in ([b""], [b"", b"", b""], [b"x" * 100, b"y"], [b"CLVM" + b"\0" * 60]):
        client = foreign.socket(zmq.DEALER)
        client.linger = 1000
        client.connect(hub_end.endpoint)
        client.send_multipart(parts)
        client.close()
    foreign.term()
    discs.send_control(PACKED, {"discs": 5})
    assert frames.content_of(grid.receive((PACKED,))[1]) == {"discs": 5}
    grid.send_control(GO, {})
    assert hub_end.connected(1)
    assert end.connected()


# -- addresses -----------------------------------------------------------------------------------------------------------


def test_a_port_in_use_is_a_fault_of_the_environment(lines):
    hub, _ = lines(0)
    with pytest.raises(EnvironmentFailed, match=f"cannot listen on {hub.endpoint}: Address already in use"):
        link_tcp.HubTransport(hub.endpoint)


@pytest.mark.parametrize("endpoint", ["tcp://127.0.0.1:99999", "tcp://127.0.0.1", "nonsense", "tcp://203.0.113.7:5555"])
def test_an_address_that_cannot_be_listened_on_is_a_fault_of_the_environment(endpoint):
    with pytest.raises(EnvironmentFailed, match="cannot listen on"):
        link_tcp.HubTransport(endpoint)


def test_an_address_that_cannot_be_connected_to_is_a_fault_of_the_environment():
    with pytest.raises(EnvironmentFailed, match="cannot connect to"):
        link_tcp.RankTransport("tcp://127.0.0.1:port")


@pytest.mark.parametrize(
    ("endpoint", "own"),
    [
        ("tcp://127.0.0.1:5555", True),
        ("tcp://127.8.9.1:0", True),
        ("tcp://localhost:5555", True),
        ("tcp://[::1]:5555", True),
        ("tcp://0.0.0.0:5555", False),
        ("tcp://*:5555", False),
        ("tcp://192.168.1.7:5555", False),
        ("tcp://127.example.org:5555", False),
        ("tcp://[::]:5555", False),
        ("tcp://eth0:5555", False),
        ("pgm://127.0.0.1:5555", False),
    ],
)
def test_which_addresses_stay_on_this_machine(endpoint, own):
    assert link_tcp.is_loopback(endpoint) is own


def test_an_endpoint_is_read_from_its_file_once_it_is_there(tmp_path):
    assert link_tcp.endpoint_from("tcp://host:1", 0.0) == "tcp://host:1"
    with pytest.raises(EnvironmentFailed, match=r"no endpoint in .* \(link.arrival\): start fdm-server"):
        link_tcp.endpoint_from(str(tmp_path / "endpoint"), 0.1)
    with Beside(lambda: link_tcp.endpoint_from(str(tmp_path / "endpoint"), 5.0)) as beside:
        (tmp_path / "endpoint").write_text("")
        time.sleep(0.1)
        (tmp_path / "endpoint").write_text("tcp://127.0.0.1:77\n")
    assert beside.result == "tcp://127.0.0.1:77"


def test_the_server_refuses_an_address_that_others_can_reach(tmp_path, configs):
    arguments = command("fdm_server", configs / "quick_slope.toml", "--bind", "tcp://0.0.0.0:0", "--out", tmp_path / "out")
    done = finished(arguments, timeout=60)
    assert done.returncode == 4
    assert "can be reached from other machines" in done.stderr
    assert "--insecure" in done.stderr
    assert not (tmp_path / "out").exists()


def test_an_interrupted_server_that_waits_for_its_discs_ends_as_interrupted(tmp_path, configs):
    arguments = command("fdm_server", configs / "quick_slope.toml", "--bind", "tcp://127.0.0.1:0", "--out", tmp_path)
    server = subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        deadline = time.monotonic() + 40.0
        while not (tmp_path / "endpoint").exists():
            assert time.monotonic() < deadline
            time.sleep(0.05)
        time.sleep(1.0)
        server.send_signal(signal.SIGINT)
        _, said = server.communicate(timeout=30)
    finally:
        server.kill()
        server.communicate()
    assert server.returncode == 130, said
    assert "interrupted by SIGINT" in said
    assert "Traceback" not in said


def test_an_endpoint_is_an_address_with_or_without_its_protocol_or_a_file(tmp_path):
    file = tmp_path / "endpoint"
    file.write_text("tcp://127.0.0.1:7\n")
    assert link_tcp.endpoint_from("tcp://127.0.0.1:5", 0.1) == "tcp://127.0.0.1:5"
    assert link_tcp.endpoint_from("127.0.0.1:5", 0.1) == "tcp://127.0.0.1:5"
    assert link_tcp.endpoint_from(str(file), 0.1) == "tcp://127.0.0.1:7"
