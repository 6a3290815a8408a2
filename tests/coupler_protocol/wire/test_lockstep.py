"""A conversation goes on, or ends with a reason, whatever the other side or the way between does."""

import re
import threading
import time

import numpy as np
import pytest

from coupler_protocol.exits import Interrupted, PeerLost
from coupler_protocol.process.interrupt import StopRequest
from coupler_protocol.wire import frames as wire
from coupler_protocol.wire import link_inproc
from coupler_protocol.wire.lockstep import REFUSALS, Conversation
from coupler_protocol.wire.messages import (
    FAILURE,
    FAREWELL,
    FORCE,
    GO,
    HELLO,
    PACKED,
    PROTOCOL_VERSION,
    READY,
    REJECT,
    STOP,
    VELOCITY,
)  # fmt: skip
from tests.scripted_peer import SESSION, Beside, Lossy, Peer, clocks, discrete_side, hub_side

GONE = {"gravity": 9.81, "step": 3, "time": 3.0, "stage": 1}


def test_an_answer_of_the_same_turn_is_heard():
    talk, peer = discrete_side()
    talk.send_control(PACKED, {"discs": 3})
    peer.send_control(GO, 0, GONE)
    kind, frame = talk.receive((GO, STOP))
    assert kind == GO
    assert wire.content_of(frame) == GONE
    assert peer.receive().content == {"discs": 3}
    assert talk.repeated == talk.refused == 0


def test_work_is_done_while_no_message_is_there_and_a_message_waits_for_one_piece():
    talk, peer = discrete_side()
    done = []

    def pieces():
        for number in range(100):
            if number == 3:
                peer.send_control(GO, 0, GONE)
            done.append(number)
            yield

    work = pieces()
    assert talk.receive((GO,), meanwhile=work)[0] == GO
    assert done == [0, 1, 2, 3]
    assert next(work, "nothing left") is None  # the rest waits for the next message that is late


def test_a_message_is_still_awaited_when_the_work_is_done():
    talk, peer = discrete_side()

    def answer():
        time.sleep(0.1)
        peer.send_control(GO, 0, GONE)

    with Beside(answer):
        assert talk.receive((GO,), meanwhile=iter(range(3)))[0] == GO


def test_a_stop_is_obeyed_after_the_present_piece_of_work():
    talk, _ = discrete_side()
    done = []

    def pieces():
        for number in range(100):
            if number == 2:
                talk.stop.ask("enough")
            done.append(number)
            yield

    with pytest.raises(Interrupted, match="enough"):
        talk.receive((GO,), meanwhile=pieces())
    assert done == [0, 1, 2]


def test_a_lost_message_is_said_again_with_the_same_bytes():
    talk, peer = discrete_side()
    talk.send_control(PACKED, {"discs": 3})
    lost = peer.receive()

    def answer():
        again = peer.receive()
        peer.send_control(GO, 0, GONE)
        return again

    with Beside(answer) as beside:
        assert talk.receive((GO,))[0] == GO
    assert talk.repeated >= 1
    assert beside.result.flags == wire.AGAIN
    assert beside.result.frame == bytes(wire.sent_again(lost.frame))
    assert beside.result.content == lost.content


def test_a_doubled_answer_changes_nothing():
    talk, peer = discrete_side()
    peer.send_control(GO, 0, GONE)
    peer.send_control(GO, 0, GONE)
    peer.send_control(GO, 1, GONE | {"step": 4})
    talk.receive((GO,))
    assert wire.content_of(talk.receive((GO,))[1])["step"] == 4
    assert talk.refused == talk.repeated == 0


def test_words_asked_for_again_are_repeated_as_they_were():
    talk, peer = discrete_side(timeout=0.2)
    talk.send_control(READY, {"inner_mass": b"", "report": {}})
    said = peer.receive().frame
    talk.sequence = 1

    def ask():
        time.sleep(0.15)
        peer.send_control(GO, 0, GONE, again=True)
        repeated = peer.receive()
        peer.send_control(STOP, 1, {"reason": "enough"})
        return repeated.frame

    with Beside(ask) as beside:
        talk.receive((STOP,))
    assert beside.result == said


def test_a_storm_of_requests_dies_away():
    talk, peer = discrete_side(timeout=1.0)
    talk.send_control(READY, {"inner_mass": b"", "report": {}})
    talk.sequence = 1
    for _ in range(500):  # what piles up while this side computes for long
        peer.send_control(GO, 0, GONE, again=True)
    peer.send_control(STOP, 1, {"reason": "enough"})
    assert talk.receive((STOP,))[0] == STOP
    assert talk.repeated <= 2
    assert talk.refused == 0


def test_a_corrupted_answer_is_refused_and_asked_for_again(caplog):
    talk, peer = discrete_side()
    talk.send_control(PACKED, {})
    right = wire.control_frame(GO, SESSION, 1, 0, GONE)
    wrong = bytearray(right)
    wrong[wire.HEADER.size + 3] ^= 16
    peer.send(wrong)
    peer.receive()

    def answer():
        assert peer.receive().flags == wire.AGAIN
        peer.send(right)

    with Beside(answer):
        assert talk.receive((GO,))[0] == GO
    assert talk.refused == 1
    assert "checksum" in caplog.text


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"kind": GO, "sequence": 0, "session": SESSION + 1}, "another session"),
        ({"kind": GO, "sequence": 0, "session": 0}, "another session"),
        ({"kind": GO, "sequence": 0, "rank": 2}, "rank 2, not 1"),
        ({"kind": GO, "sequence": 5}, "GO 5 while turn 0 waits for GO or STOP"),
        ({"kind": FAREWELL, "sequence": 0}, "FAREWELL 0 while turn 0 waits for GO or STOP"),
        ({"kind": FAREWELL, "sequence": 0, "again": True}, "FAREWELL 0 while turn 0"),
    ],
)
def test_a_message_out_of_place_is_refused_in_words(caplog, wrong, words):
    talk, peer = discrete_side()
    peer.send_control(wrong.pop("kind"), wrong.pop("sequence"), GONE, **wrong)
    peer.send_control(GO, 0, GONE)
    assert talk.receive((GO, STOP))[0] == GO
    assert talk.refused == 1
    assert words in caplog.text


def test_a_peer_that_cannot_be_understood_is_given_up():
    talk, peer = discrete_side(timeout=5.0, give_up=60.0)
    for _ in range(REFUSALS):
        peer.send_control(GO, 9, GONE)
    with pytest.raises(PeerLost, match=r"cannot be understood.*GO 9 while turn 0"):
        talk.receive((GO,))


def test_a_failure_ends_the_wait_with_the_peers_reason():
    talk, peer = discrete_side()
    peer.send_control(FAILURE, 12, {"reason": "a zone turned inside out"})
    with pytest.raises(PeerLost, match="the continuum ended: a zone turned inside out"):
        talk.receive((GO,))


@pytest.mark.parametrize("content", [{}, {"reason": 5}])
def test_a_failure_without_a_readable_reason_is_a_failure(content):
    talk, peer = discrete_side()
    peer.send_control(FAILURE, 0, content)
    with pytest.raises(PeerLost, match=r"the continuum ended.*cannot be read"):
        talk.receive((GO,))


def test_a_peer_of_another_protocol_version_is_not_waited_for(monkeypatch):
    talk, peer = discrete_side()
    monkeypatch.setattr("coupler_protocol.wire.messages.PROTOCOL_VERSION", PROTOCOL_VERSION + 1)
    frame = wire.control_frame(GO, SESSION, 1, 0, GONE)
    monkeypatch.undo()
    peer.send(frame)
    with pytest.raises(PeerLost, match=f"another language: protocol version {PROTOCOL_VERSION + 1}, not {PROTOCOL_VERSION}"):
        talk.receive((GO,))


def test_a_peer_that_went_away_is_given_up_in_time():
    talk, _ = discrete_side(timeout=0.1, give_up=0.4)
    talk.send_control(PACKED, {})
    talk.transport.connected = lambda rank: False
    begin = time.monotonic()
    with pytest.raises(PeerLost, match=r"was lost: not connected for .* s \(link.give_up = 0.4 s\)"):
        talk.receive((GO,))
    assert time.monotonic() - begin > 0.3


def test_a_thread_that_has_closed_its_end_is_not_waited_for():
    talk, peer = discrete_side(timeout=5.0, give_up=60.0)
    peer.send_control(GO, 0, GONE)
    peer.transport.close()
    assert talk.receive((GO,))[0] == GO  # what it said before counts
    with pytest.raises(PeerLost, match=r"the continuum ended without a word; read its fdm.rank0.log"):
        talk.receive((GO,))


def test_a_connected_peer_that_owes_a_step_is_given_up_later():
    talk, peer = discrete_side(timeout=0.1, give_up=0.1, step=1.0)
    talk.send_control(FORCE, {})
    peer.receive()
    begin = time.monotonic()
    with pytest.raises(PeerLost, match=r"connected, but no message of it for .* s \(link.step = 1 s\)"):
        talk.receive((VELOCITY,))
    assert time.monotonic() - begin > 0.9
    assert talk.repeated >= 3


def test_a_connected_peer_may_take_its_time_between_steps():
    talk, peer = discrete_side(timeout=0.05, give_up=0.1)

    def answer():
        time.sleep(1.2)
        peer.send_control(GO, 0, GONE)

    with Beside(answer):
        assert talk.receive((GO,))[0] == GO


def test_a_thread_that_has_ended_is_not_connected():
    talk, peer = discrete_side()
    with Beside(lambda: peer.send_control(GO, 0, GONE)):
        pass
    talk.receive((GO,))
    assert not talk.transport.connected()
    with pytest.raises(PeerLost, match="ended without a word"):
        talk.receive((GO,))


def test_a_stop_is_obeyed_even_when_messages_never_stop():
    talk, peer = discrete_side()
    peer.send_control(GO, 0, GONE)
    talk.stop.ask("interrupted by SIGINT")
    with pytest.raises(Interrupted, match="SIGINT"):
        talk.receive((GO,))


def test_a_side_that_was_asked_to_stop_itself_does_not_blame_its_peer():
    talk, peer = discrete_side(timeout=5.0, give_up=60.0)

    def stop_both():
        time.sleep(0.05)
        talk.stop.ask("interrupted by SIGINT")
        peer.send_control(FAILURE, 0, {"reason": "interrupted by SIGINT"})

    with Beside(stop_both), pytest.raises(Interrupted):
        talk.receive((GO,))


def test_a_stop_is_obeyed_while_waiting():
    talk, _ = discrete_side(timeout=5.0, give_up=60.0)
    threading.Timer(0.2, talk.stop.ask, ("enough",)).start()
    with pytest.raises(Interrupted, match="enough"):
        talk.receive((GO,))


# -- the continuum's side ------------------------------------------------------------------------------------------------


def test_messages_of_other_ranks_are_kept_for_later():
    hub, (first, second) = hub_side(2)
    second.send_control(PACKED, 0, {"discs": 2})
    first.send_control(PACKED, 0, {"discs": 1})
    for rank in (1, 2):
        _, frame = hub.conversations[rank].receive((PACKED,))
        assert wire.content_of(frame)["discs"] == rank


def test_a_failure_of_another_rank_is_heard_at_once():
    hub, (_, second) = hub_side(2, timeout=5.0, give_up=60.0)
    second.send_control(FAILURE, 0, {"reason": "no memory"})
    with pytest.raises(PeerLost, match="rank 2 ended: no memory"):
        hub.conversations[1].receive((PACKED,))


def test_strangers_cannot_keep_the_clocks_from_running():
    hub, _ = hub_side(1, timeout=0.1, progress=0.3)
    stranger = Peer(link_end(hub, "stranger"), 0)
    ended = threading.Event()

    def flood():
        while not ended.wait(0.001):
            stranger.send(b"no frame of ours")

    with Beside(flood):
        try:
            with pytest.raises(PeerLost, match=r"connected, but no message of it for .* s \(link.progress = 0.3 s\)"):
                hub.conversations[1].receive((PACKED,))
        finally:
            ended.set()


def link_end(hub, name):
    """One more end on the hub's in-process link."""
    inbox = hub.transport.outboxes.setdefault(name, link_inproc.queue.Queue())
    return link_inproc.InprocTransport(inbox, {0: hub.transport.inbox}, name, hub.transport.users)


@pytest.mark.parametrize(
    ("holder_lives", "claims", "words"),
    [(True, 1, "rank 1 is taken and its holder lives"), (False, 1, "cannot be replaced"), (True, 7, r"ranks \[1\], not 7")],
)
def test_a_claim_during_the_run_is_turned_away_with_the_reason(holder_lives, claims, words):
    hub, (holder, *_) = hub_side(1, progress=0.5)
    if not holder_lives:
        holder.transport.close()
    late = Peer(link_end(hub, "late"), 0, rank=claims, session=0)
    late.send_control(HELLO, 0, {})
    with pytest.raises(PeerLost):
        hub.conversations[1].receive((PACKED,))
    answer = late.receive()
    assert (answer.kind, answer.session, answer.sequence) == (REJECT, 0, 0)
    assert re.search(words, answer.content["reason"])


def test_a_process_of_an_earlier_run_is_told_so():
    hub, (holder, *_) = hub_side(1)
    old = Peer(link_end(hub, "old"), 0, session=99)
    old.send_control(FORCE, 55, again=True)
    holder.send_control(PACKED, 0)
    hub.conversations[1].receive((PACKED,))
    talk = Conversation(old.transport, 1, 0, clocks(), StopRequest())
    talk.begin(99)
    talk.sequence = 55
    with pytest.raises(PeerLost, match="another run"):
        talk.receive((VELOCITY,))


def test_failures_can_be_told_before_anybody_came():
    transport, ends = link_inproc.transports(2)
    hub = hub_side(2)[0]
    hub.transport = transport
    for conversation in hub.conversations.values():
        conversation.transport = transport
    hub.notify_all(FAILURE, {"reason": "interrupted"})
    assert all(end.receive(0.01) is None for end in ends)


# -- both sides, and a bad way between ------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(4))
def test_what_arrives_is_bit_equal_over_a_line_that_loses_doubles_and_corrupts(seed):
    turns, K = 150, 6
    numbers = np.random.default_rng(seed).integers(0, 2**62, (2, turns, K)).view(np.float64)
    numbers = np.where(np.isfinite(numbers), numbers, 5e-324)
    hub, ends = link_inproc.transports(1)
    hub.admit("thread 1", 1)
    discs = Conversation(Lossy(ends[0], 2 * seed), 1, 0, clocks(0.02, 5.0), StopRequest())
    grid = Conversation(Lossy(hub, 2 * seed + 1), 1, 1, clocks(0.02, 5.0), StopRequest())
    heard = np.zeros_like(numbers)
    frames = {kind: [wire.StepFrame(kind, SESSION, 1, 0, K) for _ in range(2)] for kind in (FORCE, VELOCITY)}

    def say(talk, kind, values):
        frame = frames[kind][0]
        frame.values[:] = values
        talk.send_step(frame)

    def hear(talk, kind, into):
        frame = frames[kind][1]
        frame.accept(talk.receive((kind,))[1])
        into[:] = frame.values

    def run_grid():
        for i in range(turns):
            hear(grid, FORCE, heard[0, i])
            say(grid, VELOCITY, numbers[1, i])
        with pytest.raises(PeerLost, match="done"):  # stays to repeat its last words until it is told
            grid.receive((FORCE,))

    for talk in (discs, grid):
        talk.begin(SESSION)
    with Beside(run_grid):
        for i in range(turns):
            say(discs, FORCE, numbers[0, i])
            hear(discs, VELOCITY, heard[1, i])
        discs.transport.inner.send(wire.control_frame(FAILURE, SESSION, 1, turns, {"reason": "done"}))
    assert discs.transport.faults + grid.transport.faults > 10
    assert discs.repeated + grid.repeated > 0
    assert heard.tobytes() == numbers.tobytes()
