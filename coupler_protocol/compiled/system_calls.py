"""Functions of the C library for compiled loops: calls of the operating system, and hypot; all of them also run uncompiled.

A function of the C library is called by its name, which the disk cache keeps; an address would change with every start.
Source: IEEE Std 1003.1, read, write, poll, shutdown, clock_gettime, hypot; IEEE Std 1003.1-2004, usleep.
"""

import contextlib
import os
import select
import socket
import time
from typing import Any

import numba
import numpy as np
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from coupler_protocol.compiled.jit import jit

READABLE = select.POLLIN << 32  # with the descriptor below: a struct pollfd

if numba.config.DISABLE_JIT:

    def _bytes(array: np.ndarray, first: int, last: int) -> memoryview:
        return memoryview(array).cast("B")[first:last]

    def read(fd: int, array: np.ndarray, first: int, last: int) -> int:
        """Reads into the bytes first..last of the array; number of bytes, 0 at the end of the stream, -1 if there are none."""
        try:
            return os.readv(fd, [_bytes(array, first, last)])
        except BlockingIOError:
            return -1
        except OSError:
            return 0

    def write(fd: int, array: np.ndarray, first: int, last: int) -> int:
        """Writes the bytes first..last of the array; number of bytes, -1 if none could be written."""
        try:
            return os.writev(fd, [_bytes(array, first, last)])
        except OSError:
            return -1

    def sleep(fd: int, asked: np.ndarray, milliseconds: int) -> int:
        """Sleeps until the stream can be read; 0 if it cannot after that time."""
        return len(select.select([int(fd)], [], [], 1e-3 * milliseconds)[0])

    def wait_for_two(one: int, other: int, wanted: int, asked: np.ndarray, milliseconds: int) -> int:
        """Sleeps until one of two streams is ready; events that happened, wanted: as poll has them, those of `other` << 16."""
        poll = select.poll()
        for fd, events in ((int(one), wanted & 0xFFFF), (int(other), wanted >> 16)):
            if events:
                poll.register(fd, events)
        return sum(events << 16 * (fd == other) for fd, events in poll.poll(None if milliseconds < 0 else milliseconds))

    def end_stream(fd: int) -> None:
        """Tells the other end of a socket that this end has said all."""
        with contextlib.suppress(OSError), socket.socket(fileno=os.dup(int(fd))) as stream:
            stream.shutdown(socket.SHUT_WR)

    def rest(microseconds: int) -> None:
        """Sleeps for some microseconds."""
        time.sleep(1e-6 * microseconds)

    def nanoseconds(asked: np.ndarray) -> int:
        """Monotonic time [ns]."""
        return time.monotonic_ns()

    def hypot(x: float, y: float) -> float:
        """Length of (x, y), rounded as by numpy; numba's own function rounds otherwise."""
        return float(np.hypot(x, y))

else:
    hypot = types.ExternalFunction("hypot", types.float64(types.float64, types.float64))
    _read = types.ExternalFunction("read", types.intp(types.int32, types.voidptr, types.uintp))
    _write = types.ExternalFunction("write", types.intp(types.int32, types.voidptr, types.uintp))
    _poll = types.ExternalFunction("poll", types.int32(types.voidptr, types.uintp, types.int32))
    _shutdown = types.ExternalFunction("shutdown", types.int32(types.int32, types.int32))
    _usleep = types.ExternalFunction("usleep", types.int32(types.uint32))
    _clock = types.ExternalFunction("clock_gettime", types.int32(types.int32, types.voidptr))
    _SHUT_WR = int(socket.SHUT_WR)
    _MONOTONIC = int(time.CLOCK_MONOTONIC)

    @intrinsic
    def _address(typing: Any, array: Any, offset: Any) -> Any:
        """Address of byte `offset` of an array."""

        def code(context, builder, signature, arguments):
            data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
            return builder.gep(builder.bitcast(data, cgutils.voidptr_t), [arguments[1]])

        return types.voidptr(array, types.intp), code

    @jit(borrows=True)
    def read(fd, array, first, last):
        """Reads into the bytes first..last of the array; number of bytes, 0 at the end of the stream, -1 if there are none."""
        return _read(fd, _address(array, first), last - first)

    @jit(borrows=True)
    def write(fd, array, first, last):
        """Writes the bytes first..last of the array; number of bytes, -1 if none could be written."""
        return _write(fd, _address(array, first), last - first)

    @jit
    def rest(microseconds):
        """Sleeps for some microseconds."""
        _usleep(microseconds)

    @jit(borrows=True)
    def sleep(fd, asked, milliseconds):
        """Sleeps until the stream can be read; 0 if it cannot after that time."""
        asked[0] = READABLE | fd
        return _poll(_address(asked, 0), 1, milliseconds)

    @jit(borrows=True)
    def wait_for_two(one, other, wanted, asked, milliseconds):
        """Sleeps until one of two streams is ready; events that happened, wanted: as poll has them, those of `other` << 16."""
        # A descriptor of -1 is left out: a stream from which nothing is wanted may have ended.
        asked[0] = (one if wanted & 0xFFFF else 0xFFFFFFFF) | (wanted & 0xFFFF) << 32
        asked[1] = (other if wanted >> 16 else 0xFFFFFFFF) | (wanted >> 16) << 32
        if _poll(_address(asked, 0), 2, milliseconds) <= 0:
            return 0
        return (asked[0] >> 48 & 0xFFFF) | (asked[1] >> 48 & 0xFFFF) << 16

    @jit(borrows=True)
    def end_stream(fd):
        """Tells the other end of a socket that this end has said all."""
        _shutdown(fd, _SHUT_WR)

    @jit(borrows=True)
    def nanoseconds(asked):
        """Monotonic time [ns]."""
        _clock(_MONOTONIC, _address(asked, 0))
        return asked[0] * 1_000_000_000 + asked[1]
