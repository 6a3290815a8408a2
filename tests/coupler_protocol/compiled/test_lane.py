"""Frames on a byte stream between compiled loops: what was put is taken bit for bit, and nothing else is believed."""

import os
import socket
import subprocess
import sys
import time
import zlib
from pathlib import Path

import numba
import numpy as np
import pytest

from coupler_protocol.compiled import lane
from coupler_protocol.compiled.lane import CLOSED, DOUBTED, HERE, NOTHING, checksum, checksum_table, put, take
from coupler_protocol.wire import frames, messages
from coupler_protocol.wire.lanes import Lanes, Peer, step_size

SESSION, NODES = 0x1234_5678_9ABC_DEF1, 5
SIZE = step_size(messages.FORCE, NODES)


@pytest.fixture
def ends():
    """Lanes of a continuum and of its discrete process, connected."""
    a, b = socket.socketpair()
    grid = Lanes(SESSION, [Peer(1, 1, NODES)], messages.FORCE, messages.VELOCITY)
    discs = Lanes(SESSION, [Peer(0, 1, NODES)], messages.VELOCITY, messages.FORCE)
    grid.open(1, a)
    discs.open(0, b)
    yield grid, discs
    grid.close_all()
    discs.close_all()


def say(lanes, seed=1):
    """Random numbers in the outbox."""
    numbers = lanes.wire.said[5:]
    numbers[:] = np.random.default_rng(seed).normal(size=len(numbers)) * 10.0 ** np.arange(-3, len(numbers) - 3)
    return numbers.copy()


def test_the_same_uncompiled():
    """The tests of this file and of the pump pass with NUMBA_DISABLE_JIT=1, too."""
    if numba.config.DISABLE_JIT:
        pytest.skip("this is that run")
    files = (__file__, str(Path(__file__).with_name("test_pump.py")))
    words = [sys.executable, "-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider", *files]
    done = subprocess.run(words, env=os.environ | {"NUMBA_DISABLE_JIT": "1"}, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("words", [2, 10, 300])
def test_the_checksum_is_that_of_zlib(words):
    array = np.random.default_rng(words).integers(0, 2**32, words, dtype=np.uint32)
    assert checksum(checksum_table(), array, 0, words) == zlib.crc32(array.tobytes())
    assert checksum(checksum_table(), array, 2, words) == zlib.crc32(array[2:].tobytes())


def test_what_is_put_is_taken_bit_for_bit(ends):
    grid, discs = ends
    for turn in (0, 1, 2**32 - 1, 2**40):
        numbers = say(discs, turn)
        discs.wire.sequence[0] = grid.wire.sequence[0] = turn
        assert put(discs.wire, 0)
        assert frames.open_header(discs.said(0)) == (messages.FORCE, SESSION, 1, 0, turn)
        assert take(grid.wire, 0) == HERE
        assert grid.wire.heard[5:].tobytes() == numbers.tobytes()
        assert grid.wire.got[0] == 0


@pytest.mark.parametrize(("seconds", "sleeps"), [(0.01, 7), (0.03, 7), (0.07, 3)])
def test_a_frame_that_comes_in_pieces_is_taken_in_one_call(ends, monkeypatch, seconds, sleeps):
    """A piece arrives in each sleep; only after 200 ms the caller looks at its clocks, and takes the rest with the next call."""
    grid, discs = ends
    numbers, now, count = say(discs), 0, 0
    arrival = getattr(lane._arrival, "py_func", lane._arrival)
    assert put(discs.wire, 0)
    pieces = lane.read(grid.wire.fd[0], frame := np.zeros(SIZE, dtype=np.uint8), 0, SIZE) and np.array_split(frame, 7)
    waiting = list(pieces)

    def sleep(fd, asked, milliseconds):
        nonlocal now, count
        now, count = now + int(1e9 * seconds), count + 1
        os.write(discs.wire.fd[0], waiting.pop(0).tobytes())
        return 1

    monkeypatch.setattr(lane, "give_way", lambda: None)
    monkeypatch.setattr(lane, "sleep", sleep)
    monkeypatch.setattr(lane, "nanoseconds", lambda asked: now)
    found, calls = arrival(grid.wire, 0, 200_000_000), 1
    assert (found, count) == (HERE if sleeps == 7 else NOTHING, sleeps)
    while found == NOTHING:
        found, calls = arrival(grid.wire, 0, now + 200_000_000), calls + 1
    assert calls == -(-7 // sleeps)
    assert grid.wire.heard[5:].tobytes() == numbers.tobytes()


def test_a_frame_is_that_of_the_link(ends):
    """A frame sealed by frames.StepFrame is believed by the compiled loop, and the other way round."""
    grid, discs = ends
    frame = frames.StepFrame(messages.VELOCITY, SESSION, 1, len(messages.Order._fields), 2 * NODES)
    frame.scalars[:], frame.values[:] = 1.5, -2.5
    assert grid.send(frame.seal(3), 1)
    discs.wire.sequence[0] = 3
    assert take(discs.wire, 0) == HERE
    assert discs.wire.heard[5:].tolist() == [1.5] * 7 + [-2.5] * 10
    say(discs)
    assert put(discs.wire, 0)
    rank, heard = grid.look()
    assert (rank, bytes(heard)) == (1, bytes(discs.said(0)))
    assert grid.look() is None


@pytest.mark.parametrize("number", range(0, 8 * SIZE, 131))
def test_no_flipped_bit_is_believed(ends, number):
    grid, discs = ends
    say(discs)
    assert put(discs.wire, 0)
    frame = bytearray(discs.said(0))
    frame[number // 8] ^= 1 << number % 8
    assert take(grid.wire, 0) == HERE
    discs.sockets[0].sendall(frame)
    assert take(grid.wire, 0) == DOUBTED
    assert grid.wire.got[0] == len(frame)  # left for the conversation


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_numbers_that_are_not_finite_are_left_to_the_conversation(ends, bad):
    grid, discs = ends
    say(discs)
    discs.wire.said[-1] = bad
    assert put(discs.wire, 0)
    assert take(grid.wire, 0) == DOUBTED
    assert np.array_equal(np.frombuffer(grid.look()[1][-8:]), [bad], equal_nan=True)


def test_frames_of_other_turns_are_left_to_the_conversation(ends):
    grid, discs = ends
    say(discs)
    discs.wire.sequence[0] = 7
    assert put(discs.wire, 0)
    grid.wire.sequence[0] = 8
    assert take(grid.wire, 0) == DOUBTED
    assert frames.open_header(grid.look()[1])[-1] == 7


def test_silence_ends_the_wait_and_a_frame_in_pieces_is_one_frame(ends):
    grid, discs = ends
    assert take(grid.wire, 0) == NOTHING
    waited = grid.wire.waited[0]
    assert waited >= 0.15e9
    numbers = say(discs)
    assert put(discs.wire, 0)
    frame = bytearray(SIZE)
    grid.sockets[0].recv_into(frame)
    for begin, end in ((0, 3), (3, 100), (100, SIZE - 1)):
        discs.sockets[0].sendall(frame[begin:end])
        assert take(grid.wire, 0) == NOTHING
        assert grid.wire.got[0] == end
    discs.sockets[0].sendall(frame[SIZE - 1 :])
    assert take(grid.wire, 0) == HERE
    assert grid.wire.heard[5:].tobytes() == numbers.tobytes()


def test_a_processor_that_others_need_is_not_looked_away_from(ends, monkeypatch):
    """A look that hands the processor over for long: for some frames this side sleeps in the kernel at once, then looks again."""
    grid, _ = ends
    arrival = getattr(lane._arrival, "py_func", lane._arrival)
    monkeypatch.setattr(lane, "SLICE", 1)
    looked = []

    def others_run():
        looked.append(1)
        time.sleep(1e-3 if len(looked) == 1 else 0.0)

    monkeypatch.setattr(lane, "give_way", others_run)
    assert arrival(grid.wire, 0, 0) == NOTHING
    assert (len(looked), grid.wire.shared[0]) == (lane.LOOKS, lane.ASLEEP)
    for left in (lane.ASLEEP - 1, lane.ASLEEP - 2):
        assert arrival(grid.wire, 0, 0) == NOTHING
        assert (len(looked), grid.wire.shared[0]) == (lane.LOOKS, left)
    grid.wire.shared[0] = 0
    assert arrival(grid.wire, 0, 0) == NOTHING
    assert len(looked) == 2 * lane.LOOKS


def test_a_closed_stream_is_told(ends):
    grid, discs = ends
    discs.close(0)
    assert take(grid.wire, 0) == CLOSED
    say(grid)
    assert not put(grid.wire, 0)
    assert take(discs.wire, 0) == CLOSED
    assert not put(discs.wire, 0)
