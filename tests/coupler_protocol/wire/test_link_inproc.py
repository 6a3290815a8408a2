"""The twin of the link: threads of one process find each other, and notice when the other one ends."""

import threading

from coupler_protocol.wire import link_inproc


def in_a_thread(work):
    thread = threading.Thread(target=work)
    thread.start()
    thread.join(10.0)
    return thread


def test_frames_cross_and_are_copies():
    hub, (first, second) = link_inproc.transports(2)
    frame = bytearray(b"one")
    second.send(frame)
    frame[:] = b"two"
    sender, heard = hub.receive(1.0)
    assert (sender, bytes(heard)) == ("thread 2", b"one")
    hub.admit(sender, 7)
    hub.send(b"answer", 7)
    assert second.receive(1.0) == (0, b"answer")
    second.send(b"again")
    assert hub.receive(1.0)[0] == 7
    assert first.receive(0.01) is None


def test_what_is_sent_to_nobody_is_dropped():
    hub, (end,) = link_inproc.transports(1)
    hub.send(b"early", 1)
    assert end.receive(0.01) is None


def test_a_rank_goes_over_to_whoever_is_admitted_last():
    hub, ends = link_inproc.transports(2)
    for end in ends:
        end.send(b"hello")
        hub.admit(hub.receive(1.0)[0], 1)
    hub.send(b"yours", 1)
    assert ends[1].receive(1.0) == (0, b"yours")
    assert ends[0].receive(0.01) is None
    ends[0].send(b"still here")
    assert hub.receive(1.0)[0] == "thread 1"


def test_an_end_is_connected_while_its_thread_lives_and_until_it_is_closed():
    hub, (end,) = link_inproc.transports(1)
    assert end.connected()
    hub.receive(0.01)
    assert end.connected()
    hub.close()
    assert not end.connected()
    hub.admit("thread 1", 1)
    assert hub.connected(1)
    in_a_thread(lambda: end.send(b"last words"))
    assert not hub.connected(1)
    assert bytes(hub.receive(1.0)[1]) == b"last words"
