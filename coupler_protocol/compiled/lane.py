"""Step messages on a plain byte stream, read and written by compiled loops: no interpreter between two steps.

A lane carries frames of coupler_protocol/wire/frames.py of one size in each direction. `take` waits for one, awake for a bounded
number of looks and then in the kernel, and believes it only with the expected header, the right checksum and finite numbers;
`put` seals and sends one. Whatever else happens on the stream ends the loop with a code and is left to the conversation
(coupler_protocol/wire/lockstep.py), which also has the other link. All functions also run uncompiled.
"""

from typing import NamedTuple

import numpy as np

from coupler_protocol.compiled.jit import jit
from coupler_protocol.compiled.system_calls import nanoseconds, read, sleep, write
from coupler_protocol.compiled.waiting_words import give_way

HERE, NOTHING, CLOSED, DOUBTED = range(4)  # what `take` found: a frame, no frame in time, no stream, an unexpected frame
LOOKS = 400  # at the stream with the processor given away after each, before the kernel is asked to wake this side
LONG_AWAY = 200_000  # [ns] for which another thread had the processor: it is shared, and a look would hand it over again
ASLEEP = 250  # frames for which this side then waits in the kernel at once
SLICE = 200  # [ms] of sleep in `take`, of each if bytes come in between; then the conversation looks at its clocks
HEADER_WORDS, SEQUENCE, FLAGS, CHECKSUM = 10, 6, 5, 9  # of 4 bytes: of a header, and places in it
HEADER_NUMBERS = 5  # of 8 bytes
EXPONENT = 0x7FF00000  # all ones in the upper half of numbers that are NaN or infinite
Array = np.ndarray


class Wire(NamedTuple):
    """Lanes to W peers. Frames lie one after the other in `inbox` and `outbox`, in words of 4 bytes.

    fd, got (W,): descriptor, -1 if the lane is closed; bytes of the frame under way. in_at, out_at (W+1,): first byte of a
    frame; heard, said: numbers of all frames in inbox and outbox, views as float64; in_head, out_head (W, 10): expected header,
    and header of what is sent, without sequence and checksum; sequence (W,): of the turn; waited (1,): [ns] in `take`; shared
    (1,): frames for which the processor counts as shared with others; table (8, 256) of the checksum; asked (2,): scratch memory.
    """

    fd: Array
    got: Array
    inbox: Array
    heard: Array
    in_at: Array
    in_head: Array
    outbox: Array
    said: Array
    out_at: Array
    out_head: Array
    sequence: Array
    waited: Array
    shared: Array
    table: Array
    asked: Array


def checksum_table() -> Array:
    """Table (8, 256) of CRC-32 for eight bytes at a time (polynomial 0xEDB88320, as in zlib)."""
    table = np.zeros((8, 256), dtype=np.uint32)
    for byte in range(256):
        value = byte
        for _ in range(8):
            value = (value >> 1) ^ (0xEDB88320 if value & 1 else 0)
        table[0, byte] = value
    for row in range(1, 8):
        table[row] = (table[row - 1] >> 8) ^ table[0, table[row - 1] & 255]
    return table


@jit(borrows=True)
def checksum(table: Array, words: Array, first: int, last: int) -> int:
    """CRC-32 of the words first..last (an even number of them)."""
    crc = np.uint32(0xFFFFFFFF)
    for i in range(first, last, 2):
        a, b = words[i] ^ crc, words[i + 1]
        crc = (
            table[7, a & 255] ^ table[6, (a >> 8) & 255] ^ table[5, (a >> 16) & 255] ^ table[4, a >> 24]
            ^ table[3, b & 255] ^ table[2, (b >> 8) & 255] ^ table[1, (b >> 16) & 255] ^ table[0, b >> 24]
        )  # fmt: skip
    return int(crc ^ np.uint32(0xFFFFFFFF))


@jit(borrows=True)
def take(wire: Wire, w: int) -> int:
    """Waits for the frame of this turn from peer w; returns HERE, or NOTHING, CLOSED, DOUBTED."""
    begin = nanoseconds(wire.asked)
    found = _arrival(wire, w, begin + 1_000_000 * SLICE)
    wire.waited[0] += nanoseconds(wire.asked) - begin
    return DOUBTED if found == HERE and not _believed(wire, w) else found


@jit(borrows=True)
def _arrival(wire: Wire, w: int, until: int) -> int:
    """Waits until all bytes of a frame are there; once it slept, only new bytes let it sleep again, until `until` [ns]."""
    fd, end, looks = wire.fd[w], wire.in_at[w + 1], 0
    if fd < 0:
        return CLOSED
    if wire.shared[0] > 0:
        wire.shared[0] -= 1
        looks = LOOKS
    while wire.in_at[w] + wire.got[w] < end:
        number = read(fd, wire.inbox, wire.in_at[w] + wire.got[w], end)
        if number > 0:
            wire.got[w] += number
            if looks > LOOKS and nanoseconds(wire.asked) < until:
                looks = LOOKS  # a large frame comes in pieces
        elif number == 0:
            return CLOSED
        elif looks < LOOKS:
            looks += 1
            begin = nanoseconds(wire.asked)
            give_way()
            if nanoseconds(wire.asked) - begin > LONG_AWAY:
                wire.shared[0] = ASLEEP
        elif looks > LOOKS or sleep(fd, wire.asked, SLICE) == 0:
            return NOTHING
        else:
            looks += 1
    return HERE


@jit(borrows=True)
def _believed(wire: Wire, w: int) -> bool:
    """Whether the frame in the inbox is the one of this turn, whole and finite; if so its bytes count as read."""
    words, first, last = wire.inbox, wire.in_at[w] >> 2, wire.in_at[w + 1] >> 2
    for i in range(HEADER_WORDS - 1):
        if i != SEQUENCE and i != SEQUENCE + 1 and words[first + i] != wire.in_head[w, i]:
            return False
    if words[first + SEQUENCE] != wire.sequence[w] & 0xFFFFFFFF or words[first + SEQUENCE + 1] != wire.sequence[w] >> 32:
        return False
    for i in range(first + HEADER_WORDS + 1, last, 2):  # upper halves of the numbers
        if words[i] & EXPONENT == EXPONENT:
            return False
    check = words[first + CHECKSUM]
    words[first + CHECKSUM] = 0
    right = checksum(wire.table, words, first, last) == check
    words[first + CHECKSUM] = check
    if right:
        wire.got[w] = 0
    return right


@jit(borrows=True)
def put(wire: Wire, w: int) -> bool:
    """Seals the frame in the outbox for peer w with the sequence of this turn and sends it; False if it could not be sent."""
    words, first, last = wire.outbox, wire.out_at[w] >> 2, wire.out_at[w + 1] >> 2
    for i in range(HEADER_WORDS):
        words[first + i] = wire.out_head[w, i]
    words[first + SEQUENCE], words[first + SEQUENCE + 1] = wire.sequence[w] & 0xFFFFFFFF, wire.sequence[w] >> 32
    words[first + CHECKSUM] = checksum(wire.table, words, first, last)
    return write(wire.fd[w], wire.outbox, wire.out_at[w], wire.out_at[w + 1]) == wire.out_at[w + 1] - wire.out_at[w]
