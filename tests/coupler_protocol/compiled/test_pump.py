"""Bytes between two sockets: each end gets what the other one says, in order and unchanged, also uncompiled (test_lane.py)."""

import contextlib
import os
import socket
import threading
import time

import pytest

from coupler_protocol.compiled.pump import PIECE, pass_on, pump_between

LINGER = 0.5  # [s]
LONG = 30.0  # [s] after which a test has failed


@pytest.fixture
def between():
    """A function that begins to pump: the two far ends, and the thread of the pump, which closes the near ends."""
    opened = []

    def begin(pending=(b"", b"")):
        (far, near), (other_near, other_far) = socket.socketpair(), socket.socketpair()
        opened.extend((far, near, other_near, other_far))
        for end in opened:
            end.settimeout(LONG)
        for end in (near, other_near):
            end.setblocking(False)
        pump = pump_between(near.fileno(), other_near.fileno(), pending, LINGER)

        def run():
            pass_on(pump)
            near.close()
            other_near.close()

        thread = threading.Thread(target=run, daemon=True)
        thread.start()
        return far, other_far, thread

    yield begin
    for end in opened:
        end.close()


def all_of(end):
    """What an end still gets."""
    return b"".join(iter(lambda: end.recv(PIECE), b""))


def test_what_was_pending_comes_first(between):
    one, other, _ = between((b"to one", b"first, "))
    assert one.recv(100) == b"to one"
    one.sendall(b"second")
    one.shutdown(socket.SHUT_WR)
    assert all_of(other) == b"first, second"


def test_bytes_pass_both_ways_at_once_although_nobody_takes_them_for_a_while(between):
    one, other, _ = between()
    there, back = os.urandom(40 * PIECE + 7), os.urandom(30 * PIECE + 11)
    senders = [threading.Thread(target=end.sendall, args=(data,)) for end, data in ((one, there), (other, back))]
    for sender in senders:
        sender.start()
    senders[0].join(0.1)
    assert all(sender.is_alive() for sender in senders), "a pump holds one piece for each end, not all"
    taken = bytearray()
    while len(taken) < len(back):
        taken += one.recv(PIECE)
    assert bytes(taken) == back
    senders[1].join()
    one_end = threading.Thread(target=lambda: (senders[0].join(), one.shutdown(socket.SHUT_WR)))
    one_end.start()
    assert all_of(other) == there
    one_end.join()


def test_who_has_said_all_still_hears_the_answer(between):
    one, other, thread = between()
    one.sendall(b"question")
    one.shutdown(socket.SHUT_WR)
    assert all_of(other) == b"question"
    other.sendall(b"answer")
    other.shutdown(socket.SHUT_WR)
    assert all_of(one) == b"answer"
    thread.join(LONG)
    assert not thread.is_alive()


def test_an_end_that_never_answers_is_closed_after_the_time_to_linger(between):
    one, other, thread = between()
    begin = time.monotonic()
    one.shutdown(socket.SHUT_WR)
    assert all_of(other) == b""
    thread.join(LONG)
    assert not thread.is_alive()
    assert time.monotonic() - begin > 0.9 * LINGER
    assert one.recv(1) == b""


@pytest.mark.parametrize("full", [False, True], ids=["idle", "while bytes wait for it"])
def test_an_end_that_goes_ends_the_other_connection(between, full):
    one, other, thread = between()
    if full:
        one.setblocking(False)
        with contextlib.suppress(BlockingIOError):
            while True:
                one.send(bytes(PIECE))
    other.close()
    thread.join(LONG)
    assert not thread.is_alive()
