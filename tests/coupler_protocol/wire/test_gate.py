"""Who passes the gate of a continuum, and what both sides say about who does not."""

import contextlib
import os
import re
import socket
import threading
import time
from types import SimpleNamespace

import pytest
import zmq

from coupler_protocol.exits import EnvironmentFailed
from coupler_protocol.wire import admission, gate_words, keys, link_tcp, passing, pumping
from coupler_protocol.wire.frames import control_frame
from coupler_protocol.wire.lanes import Lanes, Peer
from coupler_protocol.wire.messages import FORCE, GO, VELOCITY

ANY = "tcp://127.0.0.1:0"
SOON = 2.0  # [s] in which both sides say what is wrong


@pytest.fixture
def folder(tmp_path):
    """A key folder with `office` and `lab`, whose files are in tmp_path."""
    for name in ("office", "lab"):
        keys.new(tmp_path / "keys", name, tmp_path / f"{name}.key")
    return tmp_path / "keys"


@pytest.fixture(autouse=True)
def passed_on_by(request, monkeypatch):
    """By what the bytes of connections are passed on: pumps, if a test does not say otherwise."""
    if getattr(request, "param", "") == "Python":
        monkeypatch.setattr(pumping, "ready", lambda: False)
    else:
        said_within(120.0, pumping.ready)  # compiled, if no cache has it


BY_BOTH = pytest.mark.parametrize("passed_on_by", ["pumps", "Python"], indirect=True)


@pytest.fixture
def ends(folder, tmp_path):
    """A function that opens the continuum's end (folder: of keys; None: of this user) or a discrete end; all are closed."""
    with contextlib.ExitStack() as opened:

        def hub(folder=folder, insecure=False, endpoint=ANY):
            found = link_tcp.HubTransport(endpoint, admission.rule_of(endpoint, True, folder, insecure))
            opened.callback(lambda: found.socket.closed or found.close())
            return found

        def rank(endpoint, file=None, insecure=False):
            ticket = admission.pass_of(endpoint, True, file and tmp_path / file, insecure)
            found = link_tcp.RankTransport(endpoint, ticket)
            opened.callback(lambda: found.socket.closed or found.close())
            return found

        yield SimpleNamespace(hub=hub, rank=rank)


def said_within(seconds, *wanted):
    """Wait until every condition of `wanted` has held."""
    until = time.monotonic() + seconds
    missing = list(wanted)
    while missing:
        missing = [condition for condition in missing if not condition()]
        assert time.monotonic() < until, f"{len(missing)} of {len(wanted)} did not happen in {seconds} s"
        time.sleep(0.01)


def refusal(end):
    """Why the continuum refuses this end for good, or None."""
    try:
        end.connected()
    except EnvironmentFailed as error:
        return str(error)
    return None


def introduced(hub, end, rank=1):
    """Whether a message reaches the hub, which then knows the end as `rank`."""
    end.send(b"hello")
    heard = hub.receive(SOON)
    if heard is not None:
        hub.admit(heard[0], rank)
    return heard is not None


# -- who is refused, in words on both sides -----------------------------------------------------------------------------------


def another_continuum(folder, tmp_path):
    keys.new(tmp_path / "other", "office", tmp_path / "stranger.key")


def revoked(folder, tmp_path):
    keys.revoke(folder, "office")


def changed_secret(folder, tmp_path):
    path = tmp_path / "office.key"
    path.write_text(path.read_text().replace(keys.client_key(path).gate.hex(), "0" * 2 * keys.SECRET))


def unlisted(folder, tmp_path):
    (folder / "clients" / "office.key").unlink()


CASES = {
    "unknown key": (
        unlisted,
        "office.key",
        "does not know the key 'office' of .*: make a key there",
        "its key is not on the list",
    ),
    "revoked key": (revoked, "office.key", "has revoked the key 'office' of ", r"its key was revoked \(key 'office'\)"),
    "wrong secret": (changed_secret, "office.key", "it has another secret. Copy the key file again", "does not know the secret"),
    "wrong server key": (
        another_continuum,
        "stranger.key",
        "has another key than .*stranger.key expects",
        "of another continuum",
    ),
    "no key": (None, None, "takes clients with a key only: name the key file of this machine with --key", "it has no key"),
}


@pytest.mark.parametrize(("spoil", "file", "client", "server"), CASES.values(), ids=CASES)
def test_who_is_refused_is_told_so_and_the_log_of_the_continuum_says_it(
    ends, folder, tmp_path, caplog, spoil, file, client, server
):
    hub = ends.hub()
    if spoil is not None:
        spoil(folder, tmp_path)
    end = ends.rank(hub.endpoint, file)
    logged = lambda: any(r.name.endswith("gate") and "was refused" in r.message for r in caplog.records)  # noqa: E731
    said_within(SOON, lambda: refusal(end), logged)
    assert re.search(client, refusal(end)), refusal(end)
    (line,) = (r.message for r in caplog.records if r.name.endswith("gate"))
    assert re.search(server, line), line
    own = keys.client_key(tmp_path / "lab.key")
    for secret in (own.gate.hex(), own.secret.decode()):
        assert secret not in caplog.text


@pytest.mark.parametrize(
    ("server", "client", "words"),
    [
        ({"folder": None}, {"file": "office.key"}, "was started without keys"),
        ({"folder": None}, {"insecure": True}, "takes processes of its own user only"),
        ({"insecure": True}, {}, "was started with --insecure"),
        ({"insecure": True}, {"file": "office.key"}, "was started without keys"),
    ],
)
def test_both_sides_have_to_be_started_alike(ends, caplog, server, client, words):
    end = ends.rank(ends.hub(**server).endpoint, **client)
    said_within(SOON, lambda: refusal(end), lambda: "was refused" in caplog.text)
    assert words in refusal(end)


def test_another_user_of_the_machine_is_a_stranger(ends, monkeypatch, tmp_path, caplog):
    hub = ends.hub(folder=None)
    monkeypatch.setenv(keys.VARIABLE, str(tmp_path / "of another user"))
    end = ends.rank(hub.endpoint)
    said_within(SOON, lambda: refusal(end), lambda: "does not know the secret" in caplog.text)
    assert "belongs to another user of this machine" in refusal(end)


# -- who is no continuum ------------------------------------------------------------------------------------------------------


@pytest.fixture
def impostor():
    """A function that opens a port, answers each connection with fixed bytes and keeps it open: its endpoint."""
    with contextlib.ExitStack() as opened:

        def begin(answer, close=False):
            listener = opened.enter_context(socket.create_server(("127.0.0.1", 0)))

            def serve():
                with contextlib.suppress(OSError):
                    while True:
                        connection = opened.enter_context(listener.accept()[0])
                        connection.sendall(answer(connection) if callable(answer) else answer)
                        if close:
                            connection.close()

            threading.Thread(target=serve, daemon=True).start()
            return f"tcp://127.0.0.1:{listener.getsockname()[1]}"

        yield begin


def pretend(connection):
    """Speaks as a gate does, but knows no secret."""
    connection.sendall(gate_words.greeting(gate_words.LOCAL, bytes(16), b"n" * 32))
    claim = gate_words.read_claim(connection.recv(gate_words.CLAIM.size))
    return gate_words.verdict(gate_words.WELCOME, b"", claim, b"guessed")


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (b"HTTP/1.1 400 Bad Request\r\n\r\n", "is not a continuum of this version"),
        (b"\xff\0\0\0\0\0\0\0\x01\x7f\3", "is not a continuum of this version"),
        (gate_words.GREETING.pack(gate_words.MAGIC, 9, 0, b"", b""), "its gate has version 9, not 1"),
        (pretend, "does not know the secret of this side: it is not the continuum"),
    ],
    ids=["http", "ZeroMQ", "version", "impostor"],
)
def test_another_program_at_the_port_is_recognised(ends, impostor, answer, words):
    end = ends.rank(impostor(answer))
    said_within(SOON, lambda: refusal(end))
    assert words in refusal(end)


@pytest.mark.parametrize(("answer", "close", "words"), [(b"", False, "does not answer"), (b"", True, "it closed the connection")])
def test_a_silent_program_is_told_about_and_may_still_become_the_continuum(ends, impostor, monkeypatch, answer, close, words):
    monkeypatch.setattr(passing, "PATIENCE", 0.3)
    end = ends.rank(impostor(answer, close))
    said_within(SOON, lambda: words in end.trouble)
    assert refusal(end) is None


def test_nobody_at_the_port_is_told_about_until_the_continuum_listens(ends):
    with socket.create_server(("127.0.0.1", 0)) as free:
        endpoint = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    end = ends.rank(endpoint)
    said_within(SOON, lambda: "no program listens" in end.trouble)
    assert introduced(ends.hub(folder=None, endpoint=endpoint), end)
    assert end.trouble == ""


def test_who_takes_the_port_while_the_continuum_is_away_does_not_end_a_run(ends):
    """Once a continuum was there, only that one can refuse."""
    hub = ends.hub(folder=None)
    end = ends.rank(hub.endpoint)
    assert introduced(hub, end)
    hub.close()
    with socket.create_server(("127.0.0.1", hub.port)) as taken:
        taken.accept()[0].sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n")
        said_within(SOON, lambda: "is not a continuum" in end.trouble)
        assert refusal(end) is None
        taken.accept()[0].close()
    assert introduced(ends.hub(folder=None, endpoint=hub.endpoint), end)


# -- with keys ----------------------------------------------------------------------------------------------------------------


def test_what_goes_over_a_line_with_keys_cannot_be_read(ends, tmp_path):
    """A relay that looks at all bytes finds neither the frames nor a key."""
    hub = ends.hub()
    seen = bytearray()
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def relay():
            outside = listener.accept()[0]
            inside = socket.create_connection(("127.0.0.1", hub.port))
            for a, b in ((outside, inside), (inside, outside)):
                threading.Thread(target=copy, args=(a, b), daemon=True).start()

        def copy(source, target):
            with contextlib.suppress(OSError):
                while data := source.recv(1 << 16):
                    seen.extend(data)
                    target.sendall(data)

        threading.Thread(target=relay, daemon=True).start()
        end = ends.rank(f"tcp://127.0.0.1:{listener.getsockname()[1]}", "office.key")
        message = b"a message that nobody else reads"
        end.send(message)
        sender, frame = hub.receive(5.0)
        assert bytes(frame) == message
        hub.admit(sender, 1)
        hub.send(message, 1)
        assert bytes(end.receive(5.0)[1]) == message
    own = keys.client_key(tmp_path / "office.key")
    assert b"CURVE" in seen
    for secret in (message, own.gate, own.secret, zmq.utils.z85.decode(own.secret)):
        assert secret not in seen


def test_a_message_in_the_name_of_a_rank_needs_the_key_of_the_rank(ends, caplog):
    """Even who has a key and knows the routing id of another process cannot speak for it."""
    hub = ends.hub()
    holder, thief = ends.rank(hub.endpoint, "office.key"), ends.rank(hub.endpoint, "lab.key")
    assert introduced(hub, holder)
    thief.socket.disconnect(thief._inside)
    thief.socket.routing_id = holder.socket.routing_id
    thief.socket.connect(thief._inside)
    thief.send(b"I am rank 1")
    said_within(SOON, lambda: hub.receive(0.1) is None and "came with another key" in caplog.text)


@BY_BOTH
def test_a_key_that_is_revoked_ends_the_connection_and_the_lane(ends, folder, caplog):
    hub = ends.hub()
    end, other = ends.rank(hub.endpoint, "office.key"), ends.rank(hub.endpoint, "lab.key")
    assert introduced(hub, end, 1)
    assert introduced(hub, other, 2)
    assert end.connected()
    hub.lanes = Lanes(1, [Peer(1, 1, 4), Peer(2, 2, 4)], FORCE, VELOCITY)
    pairs = [socket.socketpair() for _ in range(2)]
    for rank, (own, _) in enumerate(pairs, start=1):
        hub.lanes.open(rank, own)
    keys.revoke(folder, "office")
    said_within(SOON, lambda: "the key 'office' was revoked: its connection" in caplog.text, lambda: refusal(end))
    assert "has revoked the key 'office'" in refusal(end)
    assert pairs[0][1].recv(1) == b""
    pairs[1][1].setblocking(False)
    with pytest.raises(BlockingIOError):
        pairs[1][1].recv(1)
    hub.lanes = None
    said_within(SOON, lambda: hub.send(b"x", 1) or not hub.connected(1))
    hub.send(b"still here", 2)
    assert bytes(other.receive(SOON)[1]) == b"still here"
    for _, there in pairs:
        there.close()


def test_zeromq_asks_the_list_again(ends, tmp_path, caplog):
    """Past the gate, a client whose CURVE key is not on the list is refused by ZAP: here with keys of its own making."""
    hub = ends.hub()
    own = keys.client_key(tmp_path / "office.key")
    public, secret = zmq.curve_keypair()
    ticket = admission.pass_of(hub.endpoint, True, tmp_path / "office.key", False)
    end = link_tcp.RankTransport(hub.endpoint, ticket._replace(curve=own._replace(public=public, secret=secret)))
    try:
        said_within(SOON, lambda: not end.connected() and "its key is not on the list" in caplog.text)
        said_within(SOON, lambda: not end.connected() and "the handshake with the continuum failed" in caplog.text)
        assert hub.receive(0.2) is None
    finally:
        end.close()


def test_a_folder_of_keys_that_others_can_use_admits_nobody(ends, folder, caplog):
    hub = ends.hub()
    (folder / "clients" / "lab.key").chmod(0o644)
    end = ends.rank(hub.endpoint, "office.key")
    said_within(SOON, lambda: "its key cannot be checked" in caplog.text and "lab.key is open to other users" in caplog.text)
    assert hub.receive(0.1) is None
    (folder / "clients" / "lab.key").chmod(0o600)
    assert introduced(hub, end)


# -- without TCP --------------------------------------------------------------------------------------------------------------


def test_a_local_continuum_has_no_port_and_its_socket_is_of_its_user_only(ends):
    hub = link_tcp.HubTransport(link_tcp.LOCAL)
    try:
        path = hub.endpoint.removeprefix("ipc://")
        assert os.stat(os.path.dirname(path)).st_mode & 0o077 == 0
        end = link_tcp.RankTransport(hub.endpoint)
        assert introduced(hub, end)
        os.chmod(os.path.dirname(path), 0o755)
        with pytest.raises(EnvironmentFailed, match="is not a folder of this user only"):
            link_tcp.RankTransport(hub.endpoint)
        end.close()
    finally:
        hub.close()
    assert not os.path.exists(os.path.dirname(path))


def test_a_lane_of_a_local_continuum_is_a_unix_socket_as_well():
    hub = link_tcp.HubTransport(link_tcp.LOCAL)
    end = link_tcp.RankTransport(hub.endpoint)
    try:
        door, found = hub.door(), []
        beside = threading.Thread(target=lambda: found.append(end.enter(door.offer)))
        beside.start()
        own = door.admit(lambda: None)
        beside.join()
        assert own.family == found[0].family == socket.AF_UNIX
        own.sendall(b"hello")
        assert found[0].recv(5) == b"hello"
        own.close()
        found[0].close()
    finally:
        end.close()
        hub.close()


@BY_BOTH
def test_the_last_bytes_arrive_although_the_sender_closes_at_once(ends):
    hub = ends.hub(folder=None)
    end = ends.rank(hub.endpoint)
    assert introduced(hub, end)
    last = os.urandom(3 << 20)
    end.send(last)
    end.close()
    assert bytes(hub.receive(5.0)[1]) == last
    end = ends.rank(hub.endpoint)
    assert introduced(hub, end)
    hub.send(last, 1)
    beside = threading.Thread(target=hub.close)
    beside.start()
    assert bytes(end.receive(5.0)[1]) == last
    beside.join()


@BY_BOTH
def test_who_has_joined_an_open_run_comes_back_past_a_crowd_of_strangers(ends):
    """The allowance of its machine is used up; by the session of the run it is not a stranger."""
    hub = ends.hub(insecure=True)
    end = ends.rank(hub.endpoint, insecure=True)
    assert introduced(hub, end)
    hub.send(control_frame(GO, 77, 1, 0, {}), 1)
    assert end.receive(SOON) is not None
    said_within(SOON, lambda: hub._guard.rule.sessions == [(77).to_bytes(8, "little")])
    (line,) = hub._guard._guests
    allowance = hub._guard._allowance(line.outside.getpeername()[0] + ":1")
    allowance.use(1e6)
    stranger = ends.rank(hub.endpoint, insecure=True)
    said_within(SOON, lambda: "too many connections" in stranger.trouble)
    line.outside.shutdown(socket.SHUT_RDWR)
    said_within(5.0, lambda: end.send(b"back") or (hub.receive(0.2) or (0, b""))[1] == b"back")
    assert hub._guard._guests
    assert "too many" in stranger.trouble


@BY_BOTH
@pytest.mark.parametrize("insecure", [False, True])
def test_both_sides_leave_what_they_need_not_read_to_a_pump(ends, request, insecure):
    """A gate for everybody, and the way there, read frames until the run has a session."""
    hub = ends.hub(folder=None, insecure=insecure)
    end = ends.rank(hub.endpoint, insecure=insecure)
    assert introduced(hub, end)
    hub.send(control_frame(GO, 77, 1, 0, {}), 1)
    assert end.receive(SOON) is not None
    (line,) = hub._guard._guests
    pumped = [lambda which=which: which._pump is not None for which in (line, end._guard._line)]
    end.send(b"more")
    assert bytes(hub.receive(SOON)[1]) == b"more"
    if request.node.callspec.params["passed_on_by"] == "pumps":
        said_within(SOON, *pumped)
    else:
        assert not any(found() for found in pumped)


def test_a_line_goes_on_where_the_system_has_no_more_threads(ends, monkeypatch):
    def no_thread(*_):
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(pumping, "PumpThread", no_thread)
    hub = ends.hub(folder=None)
    end = ends.rank(hub.endpoint)
    assert introduced(hub, end)
    hub.send(b"answer", 1)
    assert bytes(end.receive(SOON)[1]) == b"answer"


# -- options of the servers ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (
            ("tcp://0.0.0.0:5", False, "nowhere", False),
            "can be reached from other machines: there are no keys in nowhere: make one",
        ),
        (("tcp://127.0.0.1:5", True, "nowhere", False), "there are no keys in nowhere: make one for each other machine"),
    ],
)
def test_a_continuum_without_keys_says_what_to_do(options, words):
    with pytest.raises(EnvironmentFailed, match=words):
        admission.rule_of(*options)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("tcp://203.0.113.7:5", False, None, False), "is another machine: name the key file of this one with --key FILE"),
        (("tcp://203.0.113.7:5", False, "no.key", False), "there is no key file no.key: make one"),
    ],
)
def test_a_discrete_process_without_a_key_says_what_to_do(options, words):
    with pytest.raises(EnvironmentFailed, match=words):
        admission.pass_of(*options)


def test_all_keys_revoked_are_no_keys(folder):
    for name in ("office", "lab"):
        keys.revoke(folder, name)
    with pytest.raises(EnvironmentFailed, match="there are no keys in"):
        admission.rule_of(ANY, True, folder, False)
