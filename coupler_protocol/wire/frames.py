"""Messages as bytes: one frame each, a fixed header of 40 bytes and a payload.

Step messages contain raw little-endian float64, so received numbers have the bits of the sent ones. All others contain msgpack.
Header and msgpack limits are described in docs/protocol.md.
"""

import math
import struct
import zlib
from collections.abc import Mapping
from typing import Any

import msgpack
import numpy as np

from coupler_protocol.exits import PeerLost
from coupler_protocol.wire import messages

Buffer = bytes | bytearray | memoryview  # a frame

MAGIC = b"CLVM"
HEADER = struct.Struct("<4sHHQIIQII")  # magic, version, kind, session, rank, flags, sequence, payload length, CRC-32
CRC_AT = HEADER.size - 4
AGAIN = 1  # flag: the same message sent once more
MAX_FRAME = 64 << 20  # bytes
MAX_DEPTH, MAX_ITEMS, MAX_TEXT = 32, 100_000, 1 << 20  # of control messages: tables in tables, items of one, bytes of a text


class WireError(PeerLost):
    """An invalid frame; the text names the invalid part. If the frame cannot be repeated, the run ends."""


class VersionError(WireError):
    """A valid frame of another version of the protocol."""


class StepFrame:
    """A step message in one buffer that is reused in every step: `scalars` and `values` are views into its payload."""

    def __init__(self, kind: int, session: int, rank: int, n_scalars: int, n_values: int) -> None:
        self.kind, self.session, self.rank = kind, session, rank
        self.buffer = bytearray(HEADER.size + 8 * (n_scalars + n_values))
        numbers = np.frombuffer(self.buffer, dtype="<f8", offset=HEADER.size)
        self.scalars, self.values = numbers[:n_scalars], numbers[n_scalars:]

    def seal(self, sequence: int) -> bytearray:
        """Writes header and checksum; returns the bytes to send."""
        return _seal(self.buffer, self.kind, self.session, self.rank, sequence)

    def accept(self, frame: Buffer) -> None:
        """Copies the payload of a received frame; raises WireError for another length or a number that is not finite."""
        if len(frame) != len(self.buffer):
            raise WireError(f"{messages.NAMES[self.kind]} has {len(frame)} bytes, {len(self.buffer)} were agreed")
        self.buffer[HEADER.size :] = frame[HEADER.size :]
        if not (np.isfinite(self.values).all() and np.isfinite(self.scalars).all()):
            raise WireError(f"{messages.NAMES[self.kind]} holds a number that is not finite")


def _seal(buffer: bytearray, kind: int, session: int, rank: int, sequence: int, flags: int = 0) -> bytearray:
    size = len(buffer) - HEADER.size
    HEADER.pack_into(buffer, 0, MAGIC, messages.PROTOCOL_VERSION, kind, session, rank, flags, sequence, size, 0)
    struct.pack_into("<I", buffer, CRC_AT, zlib.crc32(buffer))
    return buffer


def control_frame(kind: int, session: int, rank: int, sequence: int, content: Mapping[str, Any]) -> bytearray:
    """Frame of a control message, with its content (dictionary of plain values and bytes) as msgpack; raises ValueError."""
    frame = bytearray(HEADER.size) + msgpack.packb(content)
    if len(frame) > MAX_FRAME:
        raise ValueError(f"{messages.NAMES[kind]} of {len(frame)} bytes: no frame may have more than {MAX_FRAME}")
    return _seal(frame, kind, session, rank, sequence)


def sent_again(frame: Buffer) -> bytearray:
    """The same frame, marked as sent once more."""
    copy = bytearray(frame)
    _, _, kind, session, rank, _, sequence, _, _ = HEADER.unpack_from(copy)
    return _seal(copy, kind, session, rank, sequence, AGAIN)


def open_header(frame: Buffer) -> tuple[int, int, int, int, int]:
    """(kind, session, rank, flags, sequence) of a frame with valid magic, length, checksum and version.

    Raises VersionError for another version, WireError for other deviations.
    """
    if len(frame) < HEADER.size:
        raise WireError(f"a frame of {len(frame)} bytes is shorter than a header")
    magic, version, kind, session, rank, flags, sequence, length, crc = HEADER.unpack_from(frame)
    if magic != MAGIC:
        raise WireError("the frame is not one of ours (magic)")
    if length != len(frame) - HEADER.size:
        raise WireError(f"the frame announces {length} bytes and carries {len(frame) - HEADER.size}")
    check = zlib.crc32(frame[HEADER.size :], zlib.crc32(b"\0\0\0\0", zlib.crc32(frame[:CRC_AT])))
    if check != crc:
        raise WireError("the checksum does not fit the frame")
    if version != messages.PROTOCOL_VERSION:
        raise VersionError(f"protocol version {version}, not {messages.PROTOCOL_VERSION}")
    if not 1 <= kind < len(messages.NAMES):
        raise WireError(f"unknown kind of message {kind}")
    return kind, session, rank, flags, sequence


def kind_of(frame: Buffer) -> int:
    """Kind in the header of a frame, unchecked; 0 if the frame is too short."""
    return HEADER.unpack_from(frame)[2] if len(frame) >= HEADER.size else 0


def rank_of(frame: Buffer) -> int:
    """Rank in the header of a frame, unchecked."""
    return HEADER.unpack_from(frame)[4]


def content_of(frame: Buffer) -> dict[str, Any]:
    """Content of a control frame, with the keys and types of messages.CONTENT; raises WireError otherwise."""
    kind = kind_of(frame)
    name = messages.NAMES[kind] if kind < len(messages.NAMES) else "?"
    try:
        content = msgpack.unpackb(
            frame[HEADER.size :],
            strict_map_key=True,
            max_ext_len=0,
            max_str_len=MAX_TEXT,
            max_array_len=MAX_ITEMS,
            max_map_len=MAX_ITEMS,
        )
    except (ValueError, RecursionError, msgpack.exceptions.UnpackException) as error:
        raise WireError(f"the content of {name} is not valid msgpack: {error}") from None
    _plain_only(content, name)
    wrong = _misfit(content, messages.CONTENT.get(kind, {}), "")
    there = {key: wanted for key, wanted in messages.OPTIONAL.get(kind, {}).items() if not wrong and key in content}
    wrong = wrong or _misfit(content, there, "")
    if wrong:
        raise WireError(f"{name}: {wrong}")
    return content


def one_line(text: str, most: int = 200) -> str:
    """A text of a peer for logs and messages: without line ends and control characters, of `most` characters at most."""
    plain = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text[: most + 1])
    return plain if len(plain) <= most else plain[: most - 3] + "..."


def _plain_only(content: Any, name: str) -> None:
    """Raises WireError for tables with keys other than texts, numbers that are not finite, deep nesting, and other types."""
    open_values = [(content, 0)]
    while open_values:
        value, depth = open_values.pop()
        if depth > MAX_DEPTH:
            raise WireError(f"the content of {name} is nested too deeply")
        if isinstance(value, dict):
            if not all(isinstance(key, str) for key in value):
                raise WireError(f"{name} has a key that is not a text")
            open_values += [(item, depth + 1) for item in value.values()]
        elif isinstance(value, list):
            open_values += [(item, depth + 1) for item in value]
        elif isinstance(value, float) and not math.isfinite(value):
            raise WireError(f"{name} holds a number that is not finite")
        elif not isinstance(value, str | bytes | int | float | None):
            raise WireError(f"{name} holds a {type(value).__name__}")


def _misfit(value: Any, wanted: Any, place: str) -> str:
    """Text of the place and the deviation of a value from messages.CONTENT, or ""."""
    if isinstance(wanted, list):
        if not isinstance(value, list):
            return f"{place} is not a list"
        return next(filter(None, (_misfit(item, wanted[0], f"{place}[{i}]") for i, item in enumerate(value))), "")
    if isinstance(wanted, dict):
        if not isinstance(value, dict):
            return f"{place or 'the content'} is not a table"
        missing = [key for key in wanted if key not in value]
        if missing:
            return f"{place}.{missing[0]} is missing".lstrip(".")
        return next(filter(None, (_misfit(value[k], w, f"{place}.{k}".lstrip(".")) for k, w in wanted.items())), "")
    types = (int, float) if wanted is float else wanted
    if not isinstance(value, types) or (isinstance(value, bool) and wanted is not bool):
        return f"{place} is a {type(value).__name__}, not a {wanted.__name__}"
    return f"{place} is negative" if wanted is int and value < 0 else ""


def pack_array(array: np.ndarray) -> bytes:
    """A float64 array as bytes for a control message."""
    return np.ascontiguousarray(array, dtype="<f8").tobytes()


def unpack_array(data: bytes, columns: int | None = None, rows: int | None = None) -> np.ndarray:
    """A float64 array from `pack_array`; raises WireError for a wrong size or numbers that are not finite."""
    if len(data) % (8 * (columns or 1)) or (rows is not None and len(data) != 8 * rows * (columns or 1)):
        raise WireError(f"an array of {len(data)} bytes: another size was agreed")
    array = np.frombuffer(data, dtype="<f8").astype(np.float64)
    if not np.isfinite(array).all():
        raise WireError("an array holds a number that is not finite")
    return array.reshape(-1, columns) if columns else array
