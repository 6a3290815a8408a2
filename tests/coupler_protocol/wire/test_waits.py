"""Every wait has a clock, words and an exit code, as in the table of docs/protocol.md; one test a row, with short clocks."""

import contextlib
import re
import socket
import threading
import time
from importlib.metadata import version
from types import SimpleNamespace

import numpy as np
import pytest

from coupler_protocol.exits import ENVIRONMENT, PEER, SCENE, EnvironmentFailed, Interrupted, PeerLost, code_of
from coupler_protocol.problems import SceneError
from coupler_protocol.process.interrupt import StopRequest
from coupler_protocol.scene.scene import Link
from coupler_protocol.wire import clocks as waits
from coupler_protocol.wire import frames, link_inproc, link_tcp, messages
from coupler_protocol.wire.handshake import join, welcome_all
from coupler_protocol.wire.lockstep import MAX_HELLO, Conversation, Hub
from coupler_protocol.wire.messages import (
    FAILURE,
    FAREWELL,
    FIELD,
    FORCE,
    GO,
    HELLO,
    PACKED,
    PROGRESS,
    READY,
    REJECT,
    STOP,
    VELOCITY,
    WELCOME,
)  # fmt: skip
from fdm_server.coupling.window_talk import WindowTalk
from tests.commands import ROOT
from tests.scripted_peer import Beside, Peer, clocks, discrete_side, hub_side

RIM = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
SHORT, LONG = 0.3, 600.0  # seconds


def a_scene(**link):
    return SimpleNamespace(
        link=Link(lane=False, **link), coupling=SimpleNamespace(exchange_every=1), resolved=lambda: {"seed": 1}
    )


def a_hello():
    return {"package": version("colluvium"), "float": "<f8", "scene": {"seed": 1}}


@contextlib.contextmanager
def lost(words, code=PEER, kind=PeerLost, at_least=SHORT):
    """The block ends with an error of these words and this exit code, not before its clock; they name the clock that ran out."""
    begin = time.monotonic()
    with pytest.raises(kind, match=words) as found:
        yield
    assert time.monotonic() - begin > at_least - 0.05
    assert code_of(found.value) == code


# -- arrival -------------------------------------------------------------------------------------------------------------


def welcomed(transport, n_ranks=1, **link):
    """Waits for all ranks, with short clocks."""
    ranks = range(1, n_ranks + 1)
    hub = Hub(transport, ranks, clocks(give_up=LONG, **link), StopRequest())
    welcome_all(hub, a_scene(), dict.fromkeys(ranks, RIM))


def test_discs_that_died_before_hello_are_waited_for_until_the_clock_of_arrivals_runs_out():
    hub = link_tcp.HubTransport("tcp://127.0.0.1:*")
    link_tcp.RankTransport(hub.endpoint).close()
    with (
        contextlib.closing(hub),
        lost(rf"no .* rank 1 came within 0.3 s \(link.arrival\), since .* with the address {hub.endpoint}"),
    ):
        welcomed(hub, arrival=SHORT)


def test_what_a_process_said_before_it_died_is_told_without_its_line_ends():
    hub = link_tcp.HubTransport("tcp://127.0.0.1:*")
    gone = link_tcp.RankTransport(hub.endpoint)
    Peer(gone, 0, session=0).send_control(FAILURE, 0, {"reason": "no \x1b[31mmemory\n0 g all well"})
    with contextlib.closing(hub), lost(r"; one of rank 1 ended: no \\x1b\[31mmemory\\n0 g all well; check"):
        welcomed(hub, arrival=SHORT)
    gone.close()


def test_a_thread_that_died_before_hello_is_not_waited_for():
    hub, (end, _) = link_inproc.transports(2)
    Peer(end, 0, session=0).send_control(FAILURE, 0, {"reason": "no memory"})
    end.close()
    with lost("rank 1 ended before it joined the run; one of rank 1 ended: no memory", at_least=0.0):
        welcomed(hub, 2, arrival=LONG)


def test_hellos_that_are_rejected_do_not_start_the_clock_again():
    hub, (end,) = link_inproc.transports(1)
    stranger, over = Peer(end, 0, session=0), threading.Event()

    def flood():
        while not over.is_set():
            stranger.send_control(HELLO, 0, a_hello() | {"package": "0.0.1"})
            time.sleep(0.002)

    with Beside(flood):
        with lost("no discrete process of rank 1 came"):
            welcomed(hub, arrival=SHORT)
        over.set()


def test_processes_that_take_the_place_of_each_other_do_not_start_the_clock_again():
    hub, ends = link_inproc.transports(40)
    hub.connected = lambda rank: False
    for end in ends:
        Peer(end, 0, session=0).send_control(HELLO, 0, a_hello())

    def slowly(seconds, receive=hub.receive):
        time.sleep(0.1)
        return receive(seconds)

    hub.receive = slowly
    with lost(r"no discrete process of rank 2 came within 0.3 s"):
        welcomed(hub, 2, arrival=SHORT)


def test_a_hello_that_is_too_large_is_answered_and_not_waited_for():
    hub, (end,) = link_inproc.transports(1)
    peer = Peer(end, 0, session=0)
    peer.send_control(HELLO, 0, a_hello() | {"more": bytes(MAX_HELLO)})
    with lost("no discrete process of rank 1 came"):
        welcomed(hub, arrival=SHORT)
    answer = peer.receive()
    assert (answer.kind, answer.rank) == (REJECT, 1)
    assert re.fullmatch(rf"HELLO has 4\d{{6}} bytes, {MAX_HELLO} are allowed", answer.content["reason"])


def test_a_scene_that_is_too_long_for_hello_is_refused_where_it_is():
    _, (end,) = link_inproc.transports(1)
    talk, scene = Conversation(end, 1, 0, clocks(arrival=LONG), StopRequest()), a_scene()
    scene.resolved = lambda: {"list": ["x" * 999] * 5000}
    with lost(rf"it needs \d+ bytes in HELLO, {MAX_HELLO} are allowed\n *use files for long lists", SCENE, SceneError, 0.0):
        join(talk, scene)


def test_discs_wait_for_the_file_with_the_address(tmp_path):
    with lost(r"no endpoint in .* after 0.3 s \(link.arrival\): start fdm-server", ENVIRONMENT, EnvironmentFailed):
        link_tcp.endpoint_from(str(tmp_path / "endpoint"), SHORT)
    stop = StopRequest()
    stop.ask("interrupted by SIGINT")
    with pytest.raises(Interrupted):
        link_tcp.endpoint_from(str(tmp_path / "endpoint"), LONG, stop.check)


@pytest.mark.parametrize("there", ["nobody", "a silent program"])
def test_discs_wait_for_a_continuum_at_the_address(there):
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
        if there == "nobody":
            listener.close()
        end = link_tcp.RankTransport(f"tcp://127.0.0.1:{port}")
        talk = Conversation(end, 1, 0, clocks(give_up=0.1, arrival=SHORT), StopRequest())
        words = (
            r"the continuum was lost: not connected for .* s \(link.arrival = 0.3 s\); phase arrival, WELCOME or REJECT awaited"
        )
        with contextlib.closing(end), lost(words):
            join(talk, a_scene())


# -- a wait for each kind of message ---------------------------------------------------------------------------------------


ROWS = [  # side that waits, kinds for which it waits, key of [link]
    ("discs", (WELCOME, REJECT), "arrival"),
    ("grid", (PACKED,), "progress"),
    ("discs", (FIELD,), "progress"),
    ("grid", (READY,), "progress"),
    ("discs", (GO,), "progress"),
    ("grid", (FORCE,), "step"),
    ("discs", (VELOCITY, STOP), "step"),
    ("grid", (FAREWELL,), "farewell"),
]


def side_and_peer(side, **link):
    """The conversation of a side in the middle of a session, and a scripted peer."""
    if side == "discs":
        return discrete_side(**link)
    hub, (peer,) = hub_side(1, **link)
    return hub.conversations[1], peer


@pytest.mark.parametrize(("side", "kinds", "key"), ROWS)
def test_a_silent_peer_or_a_stranger_in_its_place_is_given_up_by_the_clock_of_the_phase(side, kinds, key):
    talk, peer = side_and_peer(side, give_up=LONG, **{key: SHORT})
    who, log = ("discrete process of rank 1", "dem.rank1.log") if side == "grid" else ("continuum", "fdm.rank0.log")
    phase, awaited = waits.PHASES[kinds[0]], " or ".join(messages.NAMES[kind] for kind in kinds)
    said = "no message of it" if phase.restarts else f"no {awaited}"
    words = (
        rf"the {who} was lost: connected, but {said} for \d+\.\d s \(link.{key} = 0.3 s\); phase {phase.name}, {awaited} "
        rf"awaited since \d\d:\d\d:\d\d; check that the process runs and {phase.due}, its {log}, and whether another program"
    )
    with lost(words):
        talk.receive(kinds)
    assert peer is not None


@pytest.mark.parametrize(("side", "kinds", "key"), ROWS[1:])
def test_a_peer_without_a_connection_is_given_up_in_every_phase(side, kinds, key):
    talk, _ = side_and_peer(side, give_up=SHORT, **{key: LONG})
    talk.transport.connected = lambda rank: False
    with lost(r"was lost: not connected for .* s \(link.give_up = 0.3 s\); phase .* and the network and the address"):
        talk.receive(kinds)


@pytest.mark.parametrize(("side", "kinds", "key"), [("grid", (PACKED,), "progress"), ("discs", (VELOCITY, STOP), "step")])
def test_a_peer_that_tells_of_its_progress_may_take_its_time_but_not_for_ever(side, kinds, key):
    talk, peer = side_and_peer(side, give_up=LONG, phase=4 * SHORT, **{key: SHORT})
    hangs, again, over = time.monotonic() + 2 * SHORT, threading.Event(), threading.Event()

    def compute():
        while not over.wait(0.02):
            if time.monotonic() < hangs or again.is_set():
                peer.send_control(PROGRESS, 7, {"doing": "growing\n35 %"})

    with Beside(compute):
        try:
            with lost(
                r"connected, but no message .*; its last word, at \d\d:\d\d:\d\d: growing\\n35 %; check", at_least=3 * SHORT
            ):
                talk.receive(kinds)
            again.set()
            with lost(r"connected, but no .* for .* s \(link.phase = 1.2 s\)", at_least=4 * SHORT):
                talk.receive(kinds)
        finally:
            over.set()


@pytest.mark.parametrize(("side", "kinds", "key"), [row for row in ROWS if not waits.PHASES[row[1][0]].restarts])
def test_progress_does_not_prolong_arrival_and_farewell(side, kinds, key):
    talk, peer = side_and_peer(side, give_up=LONG, **{key: SHORT})
    for _ in range(3):
        peer.send_control(PROGRESS, 7, {"doing": "soon"})
    with lost("link." + key):
        talk.receive(kinds)


def test_a_progress_that_cannot_be_read_is_refused_like_any_other_message():
    talk, peer = discrete_side(progress=SHORT)
    peer.send_control(PROGRESS, 0, {"done": 0.5})
    with lost(r"link.progress"):
        talk.receive((GO,))
    assert talk.refused == 1


def test_a_missing_farewell_costs_its_clock_and_nothing_else(caplog):
    hub, (peer,) = hub_side(1, give_up=LONG, farewell=SHORT)
    talk, begin = WindowTalk(hub.conversations[1], "a", RIM), time.monotonic()
    peer.send_control(FORCE, 0)
    assert talk.send_stop("all stages done") == {}
    assert time.monotonic() - begin > SHORT
    assert "no farewell of rank 1: the discrete process of rank 1 was lost: connected, but no FAREWELL" in caplog.text


# -- several windows -------------------------------------------------------------------------------------------------------


def test_ranks_that_wait_for_another_one_are_told_so():
    hub, (first, second) = hub_side(2, give_up=LONG, progress=SHORT)
    with lost("rank 1 was lost"):
        hub.conversations[1].receive((PACKED,))
    heard = second.receive()
    assert (heard.kind, heard.content) == (PROGRESS, {"doing": "packing: waits for rank 1"})
    assert first.receive(0.01) is None


def test_a_rank_that_goes_while_another_one_is_waited_for_is_missed():
    hub, _ = hub_side(2, timeout=0.1, give_up=SHORT, progress=1.0)
    hub.transport.connected = lambda rank: rank == 1
    with lost(r"rank 2 was lost: not connected for .* \(link.give_up = 0.3 s\) during: packing: waits for rank 1; check"):
        hub.conversations[1].receive((PACKED,))


def test_a_rank_that_goes_while_the_grid_computes_alone_is_missed_and_the_others_are_told_of_its_steps():
    hub, (first, second) = hub_side(2, give_up=SHORT, progress=SHORT)
    hub.report("equilibrium", 200)
    assert [peer.receive().content for peer in (first, second)] == [{"doing": "equilibrium: step 200"}] * 2
    hub.transport.connected = lambda rank: rank == 1
    with lost("rank 2 was lost: not connected .* during: equilibrium"):
        while True:
            hub.report("equilibrium", 201)
            time.sleep(0.01)


def test_who_has_come_is_told_who_has_not():
    hub, (end, _) = link_inproc.transports(2)
    peer = Peer(end, 0, session=0)
    peer.send_control(HELLO, 0, a_hello())
    with lost("rank 2 came"):
        welcomed(hub, 2, arrival=SHORT, progress=SHORT)
    assert [peer.receive().kind, peer.receive().content] == [WELCOME, {"doing": "arrival: waits for rank 2"}]


# -- the table -------------------------------------------------------------------------------------------------------------


def test_the_table_in_the_document_has_the_clocks_and_defaults_of_the_scene():
    text = (ROOT / "docs" / "protocol.md").read_text(encoding="utf-8")
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if line.startswith("|")]
    found = {(row[0], row[2]): row for row in rows if len(row) == 6 and re.match(r"`link\.\w+`", row[3])}
    defaults = Link()
    for row in found.values():
        key = re.match(r"`link\.(\w+)`", row[3])[1]
        assert float(row[4].replace(",", "")) == getattr(defaults, key), row
    for _, kinds, key in ROWS:
        awaited = ", ".join(messages.NAMES[kind] for kind in kinds)
        phase = waits.PHASES[kinds[0]]
        assert key == phase.clock
        assert found[phase.name, awaited][3].startswith(f"`link.{key}`"), awaited
    assert {key for row in found.values() for key in re.findall(r"`link\.(\w+)`", row[3])} == set(Link.model_fields) - {
        "lane",
        "timeout",
    }
    assert frames.MAX_FRAME == 64 << 20
