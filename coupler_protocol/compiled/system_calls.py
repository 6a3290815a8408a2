"""Functions of the C library for compiled loops: calls of the operating system, and hypot; all of them also run uncompiled.

A function of the C library is called by its name, which the disk cache keeps; an address would change with every start.
Source: IEEE Std 1003.1, read, write, poll, clock_gettime, hypot; IEEE Std 1003.1-2004, usleep.
"""

import os
import select
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
    _usleep = types.ExternalFunction("usleep", types.int32(types.uint32))
    _clock = types.ExternalFunction("clock_gettime", types.int32(types.int32, types.voidptr))
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
    def nanoseconds(asked):
        """Monotonic time [ns]."""
        _clock(_MONOTONIC, _address(asked, 0))
        return asked[0] * 1_000_000_000 + asked[1]
