"""Both sides find out that they compute the same thing, or why not."""

import copy
import re
import time
from contextlib import ExitStack
from importlib.metadata import version

import numpy as np
import pytest

from coupler_protocol.exits import PeerLost
from coupler_protocol.process.interrupt import StopRequest
from coupler_protocol.scene import run_number
from coupler_protocol.scene.differences import first_difference
from coupler_protocol.scene.moments import Moment
from coupler_protocol.scene.reader import read_scene
from coupler_protocol.wire import frames, link_inproc, link_tcp
from coupler_protocol.wire.handshake import Choice, join, welcome_all
from coupler_protocol.wire.lockstep import Conversation, Hub
from coupler_protocol.wire.messages import FAILURE, FORCE, HELLO, PACKED, PROTOCOL_VERSION, REJECT, WELCOME
from tests.scripted_peer import Beside, Peer, clocks

RIM = np.array([[0.1, 0.2], [1 / 3, 0.2], [1 / 3, 0.9], [0.1, 0.9]])


@pytest.fixture(scope="module")
def scene(configs):
    return read_scene(configs / "quick_slope.toml")


def right_hello(scene):
    return {"package": version("colluvium"), "float": "<f8", "scene": scene.resolved()}


def a_hub(transport, n_ranks=1):
    return Hub(transport, range(1, n_ranks + 1), clocks(), StopRequest())


def changed(hello, path, value):
    """HELLO with one key of the scene replaced."""
    hello = copy.deepcopy(hello)
    *way, last = path
    table = hello["scene"]
    for key in way:
        table = table[key]
    table[last] = value
    return hello


def test_both_sides_agree_on_session_turn_and_rim(scene):
    transport, ends = link_inproc.transports(2)
    hub = a_hub(transport, 2)
    talks = [Conversation(end, rank, 0, clocks(), StopRequest()) for rank, end in enumerate(ends, start=1)]
    with (
        Beside(lambda: welcome_all(hub, scene, {1: RIM, 2: RIM + 5.0})),
        Beside(lambda: join(talks[0], scene)) as first,
        Beside(lambda: join(talks[1], scene)) as second,
    ):
        pass
    assert first.result[0].tobytes() == RIM.tobytes()
    assert second.result[0].tobytes() == (RIM + 5.0).tobytes()
    assert (first.result[1], second.result[1]) == (None, None)
    sides = [*talks, *hub.conversations.values()]
    assert {side.sequence for side in sides} == {1}
    assert len({side.session for side in sides}) == 1
    assert talks[0].session


NO_SHEAR = {"bulk": 0.5e9, "young": None, "poisson": None}


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (lambda h: h | {"package": "0.0.7"}, r"versions differ: '0.0.7' on the discrete side, '\d.*' on the continuum's"),
        (lambda h: h | {"float": ">f4"}, "number formats differ: '>f4'"),
        (lambda h: changed(h, ("grid", "height"), 13.0), r"grid.height: 13.0 on the discrete side, 12.0 on the continuum's"),
        (lambda h: changed(h, ("stage", 2, "handover"), 7), r"stage.2.handover: 7 on the discrete side, 500"),
        (lambda h: changed(h, ("material", 0, "density"), 2700.0000000000005), r"material.0.density: 2700.0000000000005"),
        (lambda h: changed(h, ("extra",), 1), "extra: only the discrete side has it"),
        (
            lambda h: changed(h, ("material", 0, "elastic"), {"bulk": 0.5e9, "young": None, "poisson": None}),
            "elastic.shear: only the continuum has it",
        ),
        (lambda h: changed(h, ("window",), []), "window: "),
        (lambda h: h | {"scene": 5}, "HELLO: scene is a int, not a dict"),
        (
            lambda h: h | {"checkpoints": [{"session": 7, "stage": 2, "step": 0}, {"session": 7, "stage": 3, "step": 900}]},
            "has saved the end of stage 'couple' and step 900 of stage 'overload', the continuum no moment",
        ),
        (lambda h: h | {"checkpoints": "couple"}, "HELLO: checkpoints is not a list"),
        (lambda h: h | {"checkpoints": [{"session": 7, "stage": 2}]}, r"HELLO: checkpoints\[0\].step is missing"),
        (lambda h: {}, "HELLO: package is missing"),
        (lambda h: h | {"scene": {b"seed": 1}}, "HELLO has a key that is not a text"),
    ],
)
def test_a_hello_that_does_not_fit_is_rejected_with_the_first_difference_and_a_good_one_is_still_welcome(scene, wrong, words):
    transport, (end,) = link_inproc.transports(1)
    peer = Peer(end, 0, session=0)
    peer.send_control(HELLO, 0, wrong(right_hello(scene)))
    peer.send_control(HELLO, 0, right_hello(scene))
    welcome_all(a_hub(transport), scene, {1: RIM})
    answer = peer.receive()
    assert (answer.kind, answer.rank, answer.sequence) == (REJECT, 1, 0)
    assert re.search(words, answer.content["reason"]), answer.content["reason"]
    assert peer.receive().kind == WELCOME


def test_a_rank_the_scene_does_not_have_is_rejected(scene):
    transport, (end,) = link_inproc.transports(1)
    wrong, right = Peer(end, 0, rank=3, session=0), Peer(end, 0, rank=1, session=0)
    wrong.send_control(HELLO, 0, right_hello(scene))
    right.send_control(HELLO, 0, right_hello(scene))
    welcome_all(a_hub(transport), scene, {1: RIM})
    assert wrong.receive().content["reason"] == "the scene has ranks [1], not 3"
    assert right.receive().kind == WELCOME


def test_a_rank_can_be_claimed_once_as_long_as_its_holder_lives(scene):
    transport, ends = link_inproc.transports(3)
    first, second, other = (Peer(end, 0, rank, session=0) for end, rank in zip(ends, (1, 1, 2), strict=True))
    for peer in (first, second, other):
        peer.send_control(HELLO, 0, right_hello(scene))
    welcome_all(a_hub(transport, 2), scene, {1: RIM, 2: RIM})
    assert first.receive().kind == WELCOME
    assert second.receive().content["reason"] == "rank 1 is taken and its holder lives"
    assert other.receive().kind == WELCOME


def test_a_rank_can_be_claimed_again_when_its_holder_went_away_before_the_run_began(scene):
    hub_end = link_tcp.HubTransport("tcp://127.0.0.1:*")
    gone, fresh, other = (link_tcp.RankTransport(hub_end.endpoint) for _ in range(3))
    try:
        hub = a_hub(hub_end, 2)
        hub.clocks.arrival = 20.0
        with Beside(lambda: welcome_all(hub, scene, {1: RIM, 2: RIM})):
            for end, rank in ((gone, 1), (fresh, 1), (other, 2)):
                peer = Peer(end, 0, rank, session=0)
                for _ in range(50):  # a closed line takes a moment to be noticed
                    peer.send_control(HELLO, 0, right_hello(scene))
                    if peer.receive(5.0).kind == WELCOME:
                        break
                else:
                    pytest.fail(f"rank {rank} was not welcome")
                if end is gone:
                    peer.send_control(PACKED, 1, {"discs": 1})
                    end.close()
        assert hub.conversations[1].sequence == 1
        assert hub.conversations[1]._inbox == []
    finally:
        for end in (fresh, other, hub_end):
            end.close()


def test_a_hello_said_again_gets_the_same_welcome(scene):
    transport, (end,) = link_inproc.transports(1)
    hub = a_hub(transport)
    peer = Peer(end, 0, session=0)
    peer.send_control(HELLO, 0, right_hello(scene))
    welcome_all(hub, scene, {1: RIM})
    welcome = peer.receive()

    def ask_again():
        time.sleep(0.07)  # sooner it would be taken for one that piled up
        peer.send_control(HELLO, 0, right_hello(scene), again=True)
        repeated = peer.receive()
        while repeated.flags:
            repeated = peer.receive()
        peer.session = repeated.session
        peer.send_control(PACKED, 1)
        return repeated.frame

    with Beside(ask_again) as beside:
        hub.conversations[1].receive((PACKED,))
    assert beside.result == welcome.frame


def test_an_absent_process_is_given_up(scene):
    transport, (end, _) = link_inproc.transports(2)
    Peer(end, 0, session=0).send_control(HELLO, 0, right_hello(scene))
    hub = a_hub(transport, 2)
    hub.clocks.arrival = 0.4
    with pytest.raises(PeerLost, match=r"no discrete process of rank 2 came within 0.4 s"):
        welcome_all(hub, scene, {1: RIM, 2: RIM})


def test_a_failure_before_everybody_is_there_ends_the_wait(scene):
    transport, (end, _) = link_inproc.transports(2)
    peer = Peer(end, 0, session=0)
    peer.send_control(HELLO, 0, right_hello(scene))
    peer.send_control(FAILURE, 0, {"reason": "no memory"})
    with pytest.raises(PeerLost, match="rank 1 ended: no memory"):
        welcome_all(a_hub(transport, 2), scene, {1: RIM, 2: RIM})


def test_nonsense_does_not_end_the_wait(scene):
    transport, (end,) = link_inproc.transports(1)
    peer = Peer(end, 0, session=0)
    peer.send(b"nonsense")
    peer.send(frames.control_frame(PACKED, 0, 1, 0, {}))
    peer.send(bytes(5 << 20))
    peer.send_control(HELLO, 0, right_hello(scene))
    welcome_all(a_hub(transport), scene, {1: RIM})
    assert "another run" in peer.receive().content["reason"]
    assert peer.receive().kind == WELCOME


def test_another_version_of_the_protocol_is_told_so(scene, monkeypatch):
    transport, (end,) = link_inproc.transports(1)
    peer = Peer(end, 0, session=0)
    monkeypatch.setattr("coupler_protocol.wire.messages.PROTOCOL_VERSION", PROTOCOL_VERSION + 1)
    peer.send_control(HELLO, 0, right_hello(scene))
    monkeypatch.undo()
    peer.send_control(HELLO, 0, right_hello(scene))
    welcome_all(a_hub(transport), scene, {1: RIM})
    answer = peer.receive()
    assert answer.kind == REJECT
    assert answer.content["reason"] == f"protocol version {PROTOCOL_VERSION + 1}, not {PROTOCOL_VERSION}"


# -- what the discrete side makes of the answer --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "content", "words"),
    [
        (REJECT, {"reason": "the scenes differ: seed"}, "refused this process: the scenes differ: seed"),
        (REJECT, {}, "REJECT: reason is missing"),
        (WELCOME, {}, "WELCOME: session is missing"),
        (WELCOME, {"session": 0, "run": 7, "rim": frames.pack_array(RIM), "dt": 1.0, "exchange_every": 1}, "no session"),
        (WELCOME, {"session": 5, "run": 7, "rim": b"\0" * 8, "dt": 1.0, "exchange_every": 1}, "another size"),
        (WELCOME, {"session": 5, "run": 1 << 48, "rim": b"", "dt": 1.0, "exchange_every": 1}, "gave the run the number"),
        (WELCOME, {"session": 5, "run": 7, "rim": b"", "dt": 1.0, "exchange_every": 1}, "a rim of 0 nodes"),
        (
            WELCOME,
            {"session": 5, "run": 7, "rim": frames.pack_array([[np.nan] * 2] * 4), "dt": 1.0, "exchange_every": 1},
            "not finite",
        ),
    ],
)
def test_an_answer_that_cannot_be_used_ends_the_discrete_side_as_the_peers_fault(scene, kind, content, words):
    hub, (end,) = link_inproc.transports(1)
    Peer(hub, "thread 1", session=0).send_control(kind, 0, content)
    with pytest.raises(PeerLost, match=words):
        join(Conversation(end, 1, 0, clocks(), StopRequest()), scene)


def test_a_continuum_that_never_answers_is_given_up_although_connected(scene):
    _, (end,) = link_inproc.transports(1)
    talk = Conversation(end, 1, 0, clocks(0.1, 0.2, arrival=0.5), StopRequest())
    with pytest.raises(PeerLost, match=r"connected, but no WELCOME or REJECT for .* s \(link.arrival = 0.5 s\)"):
        join(talk, scene)
    assert talk.repeated >= 2


def pieces(done, count):
    """Work in pieces, which it notes in the list `done`."""
    for number in range(count):
        done.append(number)
        yield


def test_the_wait_for_the_continuum_is_time_for_other_work(scene):
    transport, (end,) = link_inproc.transports(1)
    talk, done = Conversation(end, 1, 0, clocks(), StopRequest()), []
    with Beside(lambda: join(talk, scene, meanwhile=pieces(done, 5))) as there:
        while len(done) < 5:
            time.sleep(0.001)
        welcome_all(a_hub(transport), scene, {1: RIM})
    assert there.result[0].tobytes() == RIM.tobytes()
    assert done == [0, 1, 2, 3, 4]


def test_a_welcome_waits_for_one_piece_of_that_work_at_most(scene):
    hub, (end,) = link_inproc.transports(1)
    content = {"session": 5, "run": 7, "rim": frames.pack_array(RIM), "dt": 1.0, "exchange_every": 1}
    Peer(hub, "thread 1", session=0).send_control(WELCOME, 0, content)
    done = []
    join(Conversation(end, 1, 0, clocks(), StopRequest()), scene, meanwhile=pieces(done, 5))
    assert len(done) <= 1


# -- where scenes differ -------------------------------------------------------------------------------------------------


def test_what_the_wire_makes_of_a_scene_is_the_scene(scene):
    frame = frames.control_frame(HELLO, 0, 1, 0, right_hello(scene))
    assert first_difference(frames.content_of(frame)["scene"], scene.resolved()) is None
    assert frames.kind_of(frame) != FORCE


# -- what strangers are told ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (lambda h: changed(h, ("grid", "height"), 13.0), "the scenes differ: grid.height: the values differ"),
        (lambda h: changed(h, ("extra\n\x1b[31m",), 1), r"the scenes differ: extra\n\x1b[31m: only the discrete side has it"),
        (lambda h: h | {"checkpoints": [{"session": 7, "stage": 3, "step": 40}]}, "one of them continues a run, or another one"),
    ],
)
def test_who_has_not_proved_himself_is_told_names_of_keys_and_no_values(scene, caplog, wrong, words):
    transport, (end,) = link_inproc.transports(1)
    transport.proves = False
    peer = Peer(end, 0, session=0)
    peer.send_control(HELLO, 0, wrong(right_hello(scene)))
    peer.send_control(HELLO, 0, right_hello(scene))
    welcome_all(a_hub(transport), scene, {1: RIM})
    reason = peer.receive().content["reason"]
    assert words in reason
    for value in ("12.0", "13.0", "40", "\x1b", "\n"):
        assert value not in reason
    assert "\x1b" not in caplog.text
    assert caplog.text.count("\n") == len(caplog.records)


def test_thousands_of_rejections_write_a_few_lines_and_ask_the_holder_once(scene, caplog):
    transport, ends = link_inproc.transports(2)
    holder, stranger = (Peer(end, 0, session=0) for end in ends)
    hub = a_hub(transport)
    holder.send_control(HELLO, 0, right_hello(scene))
    welcome_all(hub, scene, {1: RIM})
    hub.conversations[1].begin(5)
    assert holder.receive().kind == WELCOME
    for _ in range(1000):
        stranger.send_control(HELLO, 0, {})
        stranger.send(b"nonsense")
    holder.session = 5
    holder.send_control(PACKED, 0)
    hub.conversations[1].receive((PACKED,))
    assert len(caplog.records) <= 3
    assert hub.conversations[1].repeated <= 3
    assert stranger.receive().content["reason"] == "rank 1 is taken and its holder lives"


def test_a_reason_of_a_peer_is_shown_without_its_control_characters(scene):
    hub, (end,) = link_inproc.transports(1)
    Peer(hub, "thread 1", session=0).send_control(REJECT, 0, {"reason": "no\n\x1b[2Jentry"})
    with pytest.raises(PeerLost, match=r"refused this process: no\\n\\x1b\[2Jentry"):
        join(Conversation(end, 1, 0, clocks(), StopRequest()), scene)


# -- the moment from which both sides continue ----------------------------------------------------------------------------

OLD, END, NEW = Moment(7, 2, 100), Moment(7, 2, 0), Moment(7, 3, 300)
START = Moment(7, 0, 0)


def joined(scene, own, *theirs):
    """The moments from which the continuum and each discrete process continue."""
    transport, ends = link_inproc.transports(len(theirs))
    hub = a_hub(transport, len(theirs))
    talks = [Conversation(end, rank, 0, clocks(), StopRequest()) for rank, end in enumerate(ends, start=1)]
    choice = Choice(own, lambda moment: moment.stage > 0)
    with ExitStack() as stack:
        grid = stack.enter_context(Beside(lambda: welcome_all(hub, scene, dict.fromkeys(range(1, len(theirs) + 1), RIM), choice)))
        discs = [
            stack.enter_context(Beside(lambda talk=talk, had=had: join(talk, scene, had)))
            for talk, had in zip(talks, theirs, strict=True)
        ]
    return grid.result, *(one.result.moment for one in discs)


@pytest.mark.parametrize("run", [0, 0x3F2A9C1E77B0])
def test_both_sides_have_one_number_of_the_run(scene, run):
    transport, (end,) = link_inproc.transports(1)
    choice = Choice([START], lambda moment: False, run)
    with Beside(lambda: welcome_all(a_hub(transport), scene, {1: RIM}, choice)):
        found = join(Conversation(end, 1, 0, clocks(), StopRequest()), scene).run
    assert found == run or (not run and 0 < found < 1 << run_number.BITS)


@pytest.mark.parametrize(
    ("own", "theirs", "wanted"),
    [
        ([NEW, END, START], [[NEW, END]], NEW),
        ([NEW, END, START], [[END, OLD]], END),
        ([END, OLD], [[NEW, END, OLD]], END),  # the discs were faster
        ([NEW, END], [[NEW, END], [END, OLD]], END),  # two windows
        ([START], [[]], START),  # there were no discs yet
        ([], [[]], None),
    ],
)
def test_the_newest_moment_that_all_have_counts(scene, own, theirs, wanted):
    assert set(joined(scene, own, *theirs)) == {wanted}


@pytest.mark.parametrize(
    ("own", "theirs"),
    [
        ([NEW], [END]),
        ([], [NEW]),
        ([NEW], []),
        ([NEW, START], [Moment(8, 3, 300)]),  # of another run, whose checkpoints would be lost
    ],
)
def test_sides_of_two_runs_are_kept_apart(scene, own, theirs):
    found = Choice(own, lambda moment: moment.stage > 0).objection(theirs, scene)
    assert "no moment of the same run" in found
