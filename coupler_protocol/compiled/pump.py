"""Bytes passed on between two connected sockets by a compiled loop, without the interpreter (coupler_protocol/wire/pumping.py).

Each end gets what the other one says, in order and unchanged. A pump holds at most one piece for each end: it reads no more from
one end before the other has taken that. All functions also run uncompiled.
"""

from typing import NamedTuple

import numpy as np

from coupler_protocol.compiled.jit import jit
from coupler_protocol.compiled.system_calls import end_stream, nanoseconds, read, wait_for_two, write

PIECE = 1 << 16  # bytes that are held for one end
READ, WRITE, GONE = 1, 4, 8 | 16 | 32  # POLLIN; POLLOUT; POLLERR, POLLHUP and POLLNVAL of poll(2)
MILLISECOND = 1_000_000  # [ns]
Array = np.ndarray


class Pump(NamedTuple):
    """Two ends, 0 and 1.

    fd (2,): descriptors that do not block; held (2 PIECE,): bytes, a piece for each end; first, last (2,): part of `held` that an
    end still has to get; over (2,): 1 once an end has said all; events (1,): what the kernel said of both ends last; linger (1,):
    time [ns] for the other direction once one end has said all; asked (2,): scratch memory.
    """

    fd: Array
    held: Array
    first: Array
    last: Array
    over: Array
    events: Array
    linger: Array
    asked: Array


def pump_between(one: int, other: int, pending: tuple[bytes, bytes], linger: float) -> Pump:
    """Pump between two descriptors; pending: what each end still has to get, at most PIECE bytes; linger: time [s]."""
    held, first = np.empty(2 * PIECE, dtype=np.uint8), np.array([0, PIECE])
    last = first.copy()
    for end, data in enumerate(pending):
        last[end] += len(data)
        held[first[end] : last[end]] = np.frombuffer(data, dtype=np.uint8)
    over, events, asked = (np.zeros(count, dtype=np.int64) for count in (2, 1, 2))
    return Pump(np.array([one, other]), held, first, last, over, events, np.array([int(1e9 * linger)]), asked)


@jit(borrows=True)
def pass_on(pump: Pump) -> None:
    """Passes bytes on until both ends have said all, one has gone, or the time to linger is over."""
    until = 0
    while not (pump.over[0] and pump.over[1] and _empty(pump, 0) and _empty(pump, 1)):
        moved = _move(pump, 0) + _move(pump, 1)
        if moved < 0:
            return
        milliseconds = -1
        if pump.over[0] or pump.over[1]:
            now = nanoseconds(pump.asked)
            until = until or now + pump.linger[0]
            if now >= until:
                return
            milliseconds = 1 + (until - now) // MILLISECOND
        pump.events[0] = 0
        if moved == 0:
            pump.events[0] = wait_for_two(
                pump.fd[0], pump.fd[1], _wanted(pump, 0) | _wanted(pump, 1) << 16, pump.asked, milliseconds
            )


@jit(borrows=True)
def _empty(pump: Pump, end: int) -> bool:
    """Whether an end has got all that is held for it."""
    return pump.first[end] == pump.last[end]


@jit(borrows=True)
def _wanted(pump: Pump, end: int) -> int:
    """Events of an end that are of use now."""
    reads = pump.over[end] == 0 and _empty(pump, 1 - end)
    return (READ if reads else 0) | (0 if _empty(pump, end) else WRITE)


@jit(borrows=True)
def _move(pump: Pump, end: int) -> int:
    """Reads from one end and writes to the other one; number of calls that moved something, -2 if an end has gone."""
    other, moved = 1 - end, 0
    if pump.over[end] == 0 and _empty(pump, other):
        at = other * PIECE
        number = read(pump.fd[end], pump.held, at, at + PIECE)
        if number > 0:
            pump.first[other], pump.last[other] = at, at + number
            moved += 1
        elif number == 0:
            pump.over[end] = 1
            end_stream(pump.fd[other])
            moved += 1
        elif pump.events[0] >> 16 * end & GONE:
            return -2
    if not _empty(pump, other):
        number = write(pump.fd[other], pump.held, pump.first[other], pump.last[other])
        if number > 0:
            pump.first[other] += number
            moved += 1
        elif pump.events[0] >> 16 * other & GONE:
            return -2
    return moved
